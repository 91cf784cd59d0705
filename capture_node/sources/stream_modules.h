// The optional modules of cameras and their functions. They are loaded when a deployment uses them.
#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture_node/sources/image_stream.h"
#include "common/base/process/optional_module.h"

namespace fivepipe::capture {

inline constexpr base::OptionalModule kGstreamerModule{"fivepipe_gstreamer.so", "GStreamer",
                                                       "libgstreamer1.0-dev"},
    kGenicamModule{"fivepipe_genicam.so", "Aravis", "libaravis-dev"};

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
