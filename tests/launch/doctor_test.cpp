// What `fivepipe doctor` finds out about disks and other hosts.
#include <gtest/gtest.h>
#include <unistd.h>

#include "common/base/network/path_mtu.h"
#include "launch/doctor/disk_rate.h"
#include "launch/doctor/host_findings.h"
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
