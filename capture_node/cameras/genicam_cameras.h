// The GenICam cameras of this machine's networks and USB buses.
#pragma once
#include <filesystem>
#include <vector>

#include "capture_node/cameras/connected_camera.h"
#include "capture_node/sources/stream_modules.h"

namespace fivepipe::capture {

// Describes a camera that Aravis has found. `sys` is /sys.
ConnectedCamera connected_camera(const GenicamCamera& found, const std::filesystem::path& sys);

// Returns the cameras that answer within 1 s. If this build lacks Aravis, adds a line to `notes`
// and returns none.
std::vector<ConnectedCamera> genicam_cameras(const std::filesystem::path& sys,
                                             std::vector<std::string>& notes);

}  // namespace fivepipe::capture
