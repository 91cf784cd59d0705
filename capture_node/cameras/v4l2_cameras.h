// The V4L2 devices of this machine, with what their drivers report.
#pragma once
#include <filesystem>
#include <vector>

#include "capture_node/cameras/connected_camera.h"

namespace fivepipe::capture {

// Returns the devices in `dev` (/dev) that deliver images, by their permanent names if they have
// some; skips metadata devices of the same camera. A device that this user may not open is
// listed without modes. `sys` is /sys.
std::vector<ConnectedCamera> v4l2_cameras(const std::filesystem::path& dev,
                                          const std::filesystem::path& sys);

}  // namespace fivepipe::capture
