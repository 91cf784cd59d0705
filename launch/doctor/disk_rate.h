// Whether the disk takes a recording of a deployment.
#pragma once
#include <filesystem>

#include "common/config/deployment.h"
#include "launch/doctor/finding.h"

namespace fivepipe::launch {

// Upper bound of what a recording of the deployment needs, if object pixels cover this part of each
// image and of each reconstruction (0..1) [bytes/s]: object-pixel maps, colours and tiles. The
// other messages are small.
double recording_rate(const config::Deployment& deployment, double covered);

// Writes a temporary file to the folder, at most 256 MB and for at most kMaxWriteTime_s. Returns
// the rate, to the disk and not to its cache [bytes/s]. Throws std::filesystem::filesystem_error if
// it cannot.
double write_rate(const std::filesystem::path& folder);
inline constexpr double kMaxWriteTime_s = 2;

// Whether a disk that writes `rate` [bytes/s] takes the recording of the deployment. Pure.
Finding disk_rate_finding(const config::Deployment& deployment, double rate);

// The disk of the working folder, against the recording of the deployment.
Finding check_disk_rate(const config::Deployment& deployment);

}  // namespace fivepipe::launch
