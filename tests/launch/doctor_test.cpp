// What `fivepipe doctor` finds out about disks and other hosts.
#include <gtest/gtest.h>
#include <unistd.h>

#include "common/base/network/path_mtu.h"
#include "launch/doctor/disk_rate.h"
#include "launch/doctor/host_findings.h"
#include "launch/doctor/interface_findings.h"
#include "tests/support/deployments.h"
#include "tests/support/test_folder.h"
#include "tests/support/text.h"

namespace fivepipe::launch {
namespace {

using test::contains;

TEST(RecordingRate, IsThatOfMapsColoursAndTiles) {
  config::Deployment deployment;
  deployment.frame_rate_hz = 10;
  deployment.viewer.recon_width_px = 20;
  deployment.viewer.recon_height_px = 10;
  EXPECT_DOUBLE_EQ(recording_rate(deployment, 0.5), 10 * (200 * 0.5 * 7));
  config::RigCamera camera;
  camera.published.width_px = 80;
  camera.published.height_px = 10;
  camera.gives_colour = false;
  deployment.rig.cameras = {camera};
  EXPECT_DOUBLE_EQ(recording_rate(deployment, 0), 10 * 100);
  camera.gives_shape = false;
  camera.gives_colour = true;
  deployment.rig.cameras = {camera};
  EXPECT_DOUBLE_EQ(recording_rate(deployment, 0.5), 10 * (200 * 0.5 * 7 + 400 * 3 + 50));
  deployment.viewer.eye_distance_m = 0.06;
  deployment.rig.cameras.clear();
  EXPECT_DOUBLE_EQ(recording_rate(deployment, 0.5), 10 * (2 * 200 * 0.5 * 7));
}

// With objects on all pixels it writes 10 * (200 * 7 + 0) bytes/s, usually 15 % of them.
TEST(DiskRate, OnlyADiskThatIsTooSlowNeedsAdvice) {
  config::Deployment deployment;
  deployment.name = "lab";
  deployment.frame_rate_hz = 10;
  deployment.viewer.recon_width_px = 20;
  deployment.viewer.recon_height_px = 10;
  for (const double rate : {2101.0, 13'999.0, 14'001.0}) {
    const Finding finding = disk_rate_finding(deployment, rate);
    EXPECT_EQ(finding.verdict, Verdict::ok) << rate;
    EXPECT_EQ(finding.advice, "") << rate;
  }
  const Finding slow = disk_rate_finding(deployment, 2099);
  EXPECT_EQ(slow.verdict, Verdict::warn);
  EXPECT_TRUE(contains(slow.advice, "record on a faster disk")) << slow.advice;
}

TEST(WriteRate, IsMeasuredAndLeavesNoFile) {
  const test::TestFolder folder;
  EXPECT_GT(write_rate(folder.path), 1e5);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path));
}

TEST(WriteRate, AFolderThatIsNotThereIsNamed) {
  try {
    write_rate("/no/such/folder");
    FAIL();
  } catch (const std::filesystem::filesystem_error& error) {
    EXPECT_TRUE(contains(error.what(), "/no/such/folder")) << error.what();
  }
}

TEST(PathMtu, OfTheLoopbackInterface) {
  const base::PathMtu path = base::path_mtu("127.0.0.1");
  EXPECT_TRUE(path.answers);
  EXPECT_TRUE(path.arrives);
  EXPECT_GE(path.bytes, 1500);
}

const std::vector<config::Host> kHosts{{"lab1", "192.168.10.11", ""},
                                       {"lab2", "192.168.10.12", ""}};
const std::vector<base::NetworkInterface> kInterfaces{
    {"lo", {"127.0.0.1"}, true, true},
    {"eth0", {"10.0.0.5"}, true, false},
    {"eth1", {"192.168.10.11", "192.168.20.11"}, true, false}};

TEST(InterfaceFindings, TheRightInterfaceIsNamedWithTheAddress) {
  const auto by_eth1 = [](const std::string&) { return "eth1"; };
  std::vector<Finding> findings =
      interface_findings(kHosts[0], kHosts, "eth1", kInterfaces, by_eth1);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].verdict, Verdict::ok);
  EXPECT_EQ(findings[0].what, "interface of host lab1: eth1 (192.168.10.11)");
  const auto unknown = [](const std::string&) { return ""; };
  findings = interface_findings(kHosts[0], kHosts, "eth1", kInterfaces, unknown);
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].verdict, Verdict::ok) << "an unknown route is no fault";
}

TEST(InterfaceFindings, AnInterfaceWithoutTheAddressOrTheRouteIsAWarning) {
  // The route of the own address is that of the loopback interface.
  const auto route = [](const std::string& address) {
    return address == "192.168.10.12" ? "eth1" : "lo";
  };
  std::vector<Finding> findings = interface_findings(kHosts[0], kHosts, "eth0", kInterfaces, route);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].verdict, Verdict::warn);
  EXPECT_EQ(findings[0].what,
            "interface of host lab1: eth0 lacks its address 192.168.10.11, which eth1 has");
  EXPECT_EQ(findings[1].verdict, Verdict::warn);
  EXPECT_EQ(findings[1].what,
            "interface of host lab1: eth0, but packets to host lab2 (192.168.10.12) leave by eth1");
  findings = interface_findings({"lab3", "192.168.10.13", "eth1"}, kHosts, "eth1", kInterfaces,
                                [](const std::string&) { return "eth1"; });
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].what,
            "interface of host lab3: eth1 lacks its address 192.168.10.13, which "
            "this machine has not");
}

TEST(HostFindings, NameTheClockAndEachDifference) {
  const HostState own{{"beta", "doctor"}, "b", "1", {{"lab.yaml", 1}}, {}};
  ComparedHost other{{{"alpha", "up"}, "a", "1", {{"lab.yaml", 1}}, {}}, ClockOffset{1'000'000, 0}};
  std::vector<Finding> findings = findings_about(own, other);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].verdict, Verdict::ok);
  EXPECT_EQ(findings[0].what, "clock of host alpha: 1.00 ms ahead (error at most 0.00 ms)");
  EXPECT_EQ(findings[1].verdict, Verdict::ok);
  other.clock->offset_ns = -5'000'000;
  other.state.version = "2";
  other.state.files.clear();
  findings = findings_about(own, other);
  ASSERT_EQ(findings.size(), 3u);
  EXPECT_EQ(findings[0].verdict, Verdict::warn);
  EXPECT_TRUE(contains(findings[0].advice, "chrony"));
  EXPECT_EQ(findings[1].verdict, Verdict::warn);
  EXPECT_TRUE(contains(findings[1].what, "host alpha (machine a) runs fivepipe 2"));
  EXPECT_TRUE(contains(findings[2].what, "lab.yaml is not the same"));
  other.clock->offset_ns = 2'000'000'000;
  EXPECT_EQ(findings_about(own, other)[0].verdict, Verdict::fail);
  other.clock.reset();
  EXPECT_EQ(findings_about(own, other)[0].verdict, Verdict::warn);
  EXPECT_TRUE(contains(findings_about(own, other)[0].what, "not compared"));
}

}  // namespace
}  // namespace fivepipe::launch
