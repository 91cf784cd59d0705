// The recording seated4cam: a seated person and four cameras. Skipped if the recording is absent.
#include <gtest/gtest.h>

#include <filesystem>

#include "capture_node/capture.h"
#include "common/config/deployment.h"
#include "common/hull/hull.h"
#include "tests/support/capture/footage.h"

namespace fivepipe::capture {
namespace {

const std::filesystem::path kData = test::seated4cam_folder();

TEST(Seated4cam, HullTopMatchesSeatedHeight) {
  if (!std::filesystem::exists(kData)) GTEST_SKIP() << "no recording at " << kData;
  const config::Deployment deployment = config::load_deployment(
      FIVEPIPE_SOURCE_DIR "/launch/deployments/seated4cam.yaml", {{"data", kData.string()}});
  const config::CaptureConfig& config =
      std::get<config::CaptureConfig>(deployment.nodes.front().config);
  Capture capture(deployment.rig, deployment.viewer, config, deployment.frame_rate_hz);
  for (const std::int64_t frame : {0, 60, 200}) {
    std::vector<hull::Silhouette> silhouettes;
    const auto cameras = capture.capture(frame, false);
    for (std::size_t i = 0; i < cameras.size(); ++i)
      silhouettes.push_back(
          {config::published_camera(deployment.rig.cameras[i]), cameras[i].pixels.value()});
    constexpr double kStep_m = 0.02;
    const Eigen::AlignedBox3d& volume = deployment.rig.volume_m;
    double top_m = -1, hull_m3 = 0;
    for (double z = volume.min().z(); z < 2.5; z += kStep_m)
      for (double y = volume.min().y(); y < volume.max().y(); y += kStep_m)
        for (double x = volume.min().x(); x < volume.max().x(); x += kStep_m)
          if (hull::in_hull(silhouettes, {x, y, z})) {
            top_m = z;
            hull_m3 += kStep_m * kStep_m * kStep_m;
          }
    EXPECT_GE(top_m, 1.2) << "frame " << frame;
    EXPECT_LE(top_m, 1.5) << "frame " << frame;
    // A person has 0.06 to 0.1 m3. The hull adds the chair and the concavities that no camera sees.
    EXPECT_GE(hull_m3, 0.06) << "frame " << frame;
    EXPECT_LE(hull_m3, 0.30) << "frame " << frame;
  }
}

}  // namespace
}  // namespace fivepipe::capture
