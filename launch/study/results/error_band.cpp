#include "launch/study/results/error_band.h"

#include <fmt/format.h>

#include <algorithm>

namespace fivepipe::study {
namespace {

// A reprojection error is rarely larger than this multiple of its RMS.
constexpr double kErrorsPerRms = 3;

double min_focal_px(const geometry::Pinhole& pinhole) {
  return std::min(pinhole.fx_px, pinhole.fy_px);
}

}  // namespace

std::vector<report::ErrorSource> error_sources(const config::Deployment& deployment,
                                               const Eigen::Vector3d& p_world_m, double eps_m) {
  double footprint_m = 0, calibration_m = 0;
  std::size_t cameras = 0, calibrated = 0;
  for (const std::size_t i : config::shape_cameras(deployment.rig)) {
    const config::RigCamera& camera = deployment.rig.cameras[i];
    // Negative behind the camera, which does not limit the hull there: the maxima ignore it.
    const double depth_m = (camera.camera_from_mount * p_world_m).z();
    ++cameras;
    calibrated += camera.calibration_error_px.has_value();
    footprint_m = std::max(footprint_m, depth_m / min_focal_px(camera.published));
    calibration_m = std::max(calibration_m, depth_m / min_focal_px(camera.source) * kErrorsPerRms *
                                                camera.calibration_error_px.value_or(0));
  }
  std::vector<report::ErrorSource> sources{
      {"map resolution: one pixel at the part", 1e3 * footprint_m}};
  if (calibrated == 0)
    sources.push_back({"the calibration, which the rig does not state (calibration_error_px)", {}});
  else
    sources.push_back(
        {fmt::format("calibration: {} times the RMS reprojection error at the part{}",
                     kErrorsPerRms,
                     calibrated == cameras
                         ? ""
                         : fmt::format(", which {} of {} cameras state", calibrated, cameras)),
         1e3 * calibration_m});
  sources.push_back({"eps of the detection", 1e3 * eps_m});
  return sources;
}

}  // namespace fivepipe::study
