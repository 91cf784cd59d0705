// The network interfaces of this machine.
#include "common/base/network/network_interfaces.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/text.h"

namespace fivepipe::base {
namespace {

TEST(NetworkInterfaces, KnowTheLoopbackInterface) {
  const std::vector<NetworkInterface> all = network_interfaces();
  const auto lo = std::ranges::find(all, "lo", &NetworkInterface::name);
  ASSERT_NE(lo, all.end());
  for (const NetworkInterface& one : all) EXPECT_EQ(one.is_loopback, one.name == "lo") << one.name;
}

TEST(NetworkInterfaces, OneThatIsAbsentIsNamedByWhatWasAskedFor) {
  EXPECT_TRUE(test::contains(find_interface("eth77").problem,
                             "this machine has no network interface 'eth77'; it has lo ("));
  EXPECT_TRUE(test::contains(find_interface("203.0.113.7").problem,
                             "no network interface with address 203.0.113.7; it has lo ("));
}

TEST(NetworkInterfaces, TheRouteToAnAddressLeavesByOne) {
  EXPECT_EQ(route_interface("127.0.0.1"), "lo");
  EXPECT_EQ(route_interface("127.8.8.8"), "lo");
  for (const NetworkInterface& one : network_interfaces())
    for (const std::string& address : one.addresses)
      EXPECT_EQ(route_interface(address), "lo") << address << ", an address of this machine";
  EXPECT_EQ(route_interface("no address"), "");
  EXPECT_EQ(route_interface("255.255.255.256"), "");
}

}  // namespace
}  // namespace fivepipe::base
