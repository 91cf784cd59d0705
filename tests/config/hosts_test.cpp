// The machines of a deployment.
#include "common/config/network/hosts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/machine.h"
#include "common/config/deployment.h"
#include "common/config/yaml/config_error.h"
#include "tests/support/deployment_files.h"
#include "tests/support/text.h"

namespace fivepipe::config {
namespace {

using test::DeploymentFile;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;

const std::string kHosts = R"(
hosts:
  alpha: {address: 10.0.0.1}
  beta: {address: 10.0.0.2, interface: enp3s0}
)";

// The good deployment with these hosts; its first node is on alpha and its second one on beta.
std::string on_hosts(const std::string& hosts, const std::string& first = "alpha",
                     const std::string& second = "beta") {
  std::string text = test::kGoodDeployment;
  for (const auto& [node, host] : {std::pair("capture", first), {"recon", second}})
    if (!host.empty())
      text = test::replaced(text, "name: " + std::string(node) + "\n",
                            "name: " + std::string(node) + "\n    host: " + host + "\n");
  return text + hosts;
}

TEST_F(DeploymentFile, HostsHaveAddressesAndInterfaces) {
  const Deployment d = load(on_hosts(kHosts));
  ASSERT_EQ(d.hosts.size(), 2u);
  EXPECT_EQ(d.hosts[0].name, "alpha");
  EXPECT_EQ(d.hosts[0].address, "10.0.0.1");
  EXPECT_EQ(d.hosts[0].interface, "");
  EXPECT_EQ(d.hosts[1].interface, "enp3s0");
  EXPECT_EQ(d.network_profile, "lan") << "by default";
  EXPECT_EQ(
      load(on_hosts("hosts: {alpha: {address: 10.0.0.1}}\n", "alpha", "alpha")).network_profile,
      "loopback")
      << "one host needs no network";
  EXPECT_EQ(load(on_hosts(kHosts + "network_profile: lossy\n")).network_profile, "lossy");
}

TEST_F(DeploymentFile, ProblemsOfHosts) {
  EXPECT_THAT(problems(on_hosts(kHosts + "network_profile: loopback\n")),
              ElementsAre(HasSubstr("loopback reaches no other machine")));
  for (const std::string profile : {"lan", "lossy"})
    EXPECT_THAT(problems(test::kGoodDeployment + "network_profile: " + profile + "\n"),
                ElementsAre(HasSubstr("network_profile " + profile + " needs `hosts`")));
  // With the other problems of the file.
  EXPECT_THAT(problems(on_hosts(kHosts + "network_profile: lann\nframe_rate_hz: -30\n")),
              UnorderedElementsAre(
                  HasSubstr("network_profile must be one of loopback, lan, lossy; is \"lann\""),
                  HasSubstr("frame_rate_hz")));
  EXPECT_THAT(problems(on_hosts(kHosts, "alpha", "")),
              ElementsAre(HasSubstr("names no host: add host: NAME, one of alpha, beta")));
  EXPECT_THAT(problems(on_hosts(kHosts, "alpha", "bata")),
              ElementsAre(HasSubstr("hosts has no bata: did you mean beta?")));
  const auto of_alpha = [&](const std::string& keys) {
    return problems(on_hosts("hosts: {alpha: {" + keys + "}, beta: {address: 10.0.0.2}}\n"));
  };
  EXPECT_THAT(of_alpha("interface: eth0"), ElementsAre(HasSubstr("address is missing")));
  for (const char* address :
       {"10.0.0", "alpha.lab", "::1", "10.0.0.256", "0.0.0.0", "239.255.0.1", "255.255.255.255"})
    EXPECT_THAT(of_alpha("address: '" + std::string(address) + "'"),
                ElementsAre(HasSubstr("address must be an IPv4 address such as 192.168.10.11, is " +
                                      std::string(address))));
  for (const char* name : {"enp3s0<", "a name", "longer-than-15-ch"})
    EXPECT_THAT(of_alpha("address: 10.0.0.1, interface: '" + std::string(name) + "'"),
                ElementsAre(HasSubstr("interface must be a name such as enp3s0")));
  EXPECT_THAT(of_alpha("address: 10.0.0.2"),
              ElementsAre(HasSubstr("hosts alpha and beta have the same address 10.0.0.2")));
}

TEST(OwnHost, IsThatOfTheNameOrOfThisMachine) {
  const std::vector<Host> hosts{{"alpha", "10.255.255.1", ""}, {"here", "127.0.0.1", ""}};
  EXPECT_EQ(own_host(hosts, "alpha", "d.yaml").name, "alpha");
  EXPECT_EQ(own_host(hosts, "", "d.yaml").name, "here") << "by its address";
  std::vector<Host> by_name = hosts;
  by_name.push_back({base::host_name(), "10.255.255.2", ""});
  EXPECT_EQ(own_host(by_name, "", "d.yaml").name, base::host_name()) << "before the address";
  const auto error = [&](const std::vector<Host>& among, const std::string& name) {
    try {
      return own_host(among, name, "d.yaml").name;
    } catch (const ConfigError& problem) {
      return std::string(problem.what());
    }
  };
  EXPECT_THAT(error(hosts, "gamma"),
              HasSubstr("the deployment has no host gamma; choose one of them with --host: alpha "
                        "(10.255.255.1), here (127.0.0.1)"));
  EXPECT_THAT(error({hosts[0]}, ""),
              AllOf(HasSubstr("is none of the deployment's hosts; choose"),
                    HasSubstr("to observe from this machine, add it to `hosts`, without nodes")));
}

}  // namespace
}  // namespace fivepipe::config
