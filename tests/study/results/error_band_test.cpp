#include "launch/study/results/error_band.h"

#include <gtest/gtest.h>

namespace fivepipe::study {
namespace {

// Looks along z from z = -depth. Its maps have half the focal length of its images.
config::RigCamera camera(double depth_m, std::optional<double> calibration_error_px) {
  config::RigCamera camera;
  camera.source = {640, 480, 1000, 800, 320, 240};
  camera.published = {320, 240, 500, 400, 160, 120};
  camera.camera_from_mount.translation() = Eigen::Vector3d(0, 0, depth_m);
  camera.calibration_error_px = calibration_error_px;
  return camera;
}

TEST(ErrorBand, IsThatOfTheCameraThatSeesThePlaceWorst) {
  config::Deployment deployment;
  deployment.rig.cameras = {camera(2, std::nullopt), camera(1, std::nullopt)};
  const auto sources = error_sources(deployment, {0, 0, 0.4}, 0.001);
  ASSERT_EQ(sources.size(), 3u);
  EXPECT_EQ(sources[0].name, "map resolution: one pixel at the part");
  EXPECT_DOUBLE_EQ(*sources[0].bound_mm, 1e3 * 2.4 / 400);
  EXPECT_EQ(sources[1].name,
            "the calibration, which the rig does not state (calibration_error_px)");
  EXPECT_FALSE(sources[1].bound_mm);
  EXPECT_EQ(sources[2].name, "eps of the detection");
  EXPECT_DOUBLE_EQ(*sources[2].bound_mm, 1);
}

TEST(ErrorBand, ContainsTheErrorOfTheCalibration) {
  config::Deployment deployment;
  deployment.rig.cameras = {camera(2, 0.1), camera(1, 0.5)};
  auto sources = error_sources(deployment, {0, 0, 0}, 0.001);
  ASSERT_EQ(sources.size(), 3u);
  EXPECT_EQ(sources[1].name, "calibration: 3 times the RMS reprojection error at the part");
  EXPECT_DOUBLE_EQ(*sources[1].bound_mm, 1e3 * 3 * 0.5 * 1 / 800);
  deployment.rig.cameras[1].calibration_error_px.reset();
  sources = error_sources(deployment, {0, 0, 0}, 0.001);
  ASSERT_EQ(sources.size(), 3u);
  EXPECT_EQ(sources[1].name,
            "calibration: 3 times the RMS reprojection error at the part, which 1 of 2 cameras "
            "state");
  EXPECT_DOUBLE_EQ(*sources[1].bound_mm, 1e3 * 3 * 0.1 * 2 / 800);
}

// Neither a camera that gives no shape nor one behind which the place is.
TEST(ErrorBand, IgnoresCamerasThatDoNotLimitTheHullThere) {
  config::Deployment deployment;
  deployment.rig.cameras = {camera(1, 0), camera(-5, 0), camera(9, 0)};
  deployment.rig.cameras[2].gives_shape = false;
  const auto sources = error_sources(deployment, {0, 0, 0}, 0);
  EXPECT_DOUBLE_EQ(*sources.front().bound_mm, 1e3 * 1 / 400);
  EXPECT_DOUBLE_EQ(*sources[1].bound_mm, 0) << "a calibration without error is stated";
}

}  // namespace
}  // namespace fivepipe::study
