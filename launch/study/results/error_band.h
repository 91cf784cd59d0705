// What bounds the error of a clearance that is measured on a recorded hull.
#pragma once
#include <vector>

#include "common/config/deployment.h"
#include "common/study/report/study.h"

namespace fivepipe::study {

// The sources of error of a clearance at a place in the world frame, each with its bound in mm:
// - one pixel of the maps, in the camera that sees the place worst;
// - three times the RMS reprojection error of the cameras' calibration, if the rig file states one;
// - eps of the detection.
// The excess of the visual hull over the real object is not among them: it makes a clearance too
// small, never too large.
std::vector<report::ErrorSource> error_sources(const config::Deployment& deployment,
                                               const Eigen::Vector3d& p_world_m, double eps_m);

}  // namespace fivepipe::study
