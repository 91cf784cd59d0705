// The modules of optional libraries: shared libraries beside the program, which are loaded when a
// deployment uses them. A module exists only if its library was installed when fivepipe was built.
// A module holds no library of fivepipe, and only its functions below are called.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture_node/sources/image_stream.h"

namespace fivepipe::capture {

struct StreamModule {
  const char *file, *library, *package;  // package: Debian's, with the library's headers
};
inline constexpr StreamModule kGstreamerModule{"fivepipe_gstreamer.so", "GStreamer",
                                               "libgstreamer1.0-dev"},
    kGenicamModule{"fivepipe_genicam.so", "Aravis", "libaravis-dev"};

// Returns the address of a function of the module, which stays loaded. Throws std::runtime_error if
// this build has no such module, or if it cannot be loaded; the message states what to install.
void* function_of(const StreamModule& module, const char* function);

// Returns whether this build has the module.
bool exists(const StreamModule& module);

// In fivepipe_gstreamer.so. `pipeline` has no sink; see gst-launch-1.0.
inline constexpr const char* kMakeGstreamerStream = "fivepipe_make_gstreamer_stream";
using MakeGstreamerStream = void(const std::string& pipeline, std::unique_ptr<ImageStream>& stream);

// In fivepipe_genicam.so.
struct GenicamSettings {
  std::string camera;  // name, serial number or address
  int width_px, height_px;
  std::optional<double> exposure_us, gain_db;
};
inline constexpr const char* kMakeGenicamStream = "fivepipe_make_genicam_stream";
using MakeGenicamStream = void(const GenicamSettings& settings,
                               std::unique_ptr<ImageStream>& stream);

// A camera that Aravis discovers. The sensor, the rate and the formats are unknown if another
// program controls the camera.
struct GenicamCamera {
  std::string name, vendor, model, serial, protocol;
  std::string address;  // IP address; of a USB camera, any text
  int sensor_width_px = 0, sensor_height_px = 0;
  double rate_hz = 0;
  std::vector<std::string> pixel_formats;
  std::string why_unknown;  // empty if it could be opened
};
// Takes at least 1 s: cameras answer within that time.
inline constexpr const char* kListGenicamCameras = "fivepipe_list_genicam_cameras";
using ListGenicamCameras = void(std::vector<GenicamCamera>& cameras);

}  // namespace fivepipe::capture
