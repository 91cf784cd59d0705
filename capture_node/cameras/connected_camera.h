// A camera that is connected to this machine, and the link over which it sends its images.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace fivepipe::capture {

struct CameraMode {
  std::string format;
  int width_px = 0, height_px = 0;
  double rate_hz = 0;      // the highest; 0: unknown
  int bits_per_pixel = 0;  // on the link; 0: compressed or unknown
};

// Returns the bandwidth of the images [Mbit/s]; nullopt if it is unknown or depends on the image.
inline std::optional<double> bandwidth_mbit_s(const CameraMode& mode) {
  if (mode.bits_per_pixel <= 0 || !(mode.rate_hz > 0)) return std::nullopt;
  return 1e-6 * mode.rate_hz * mode.bits_per_pixel * mode.width_px * mode.height_px;
}

// A USB bus or a network interface.
struct CameraLink {
  std::string name;         // "USB bus 2", "network interface eth0"; empty: unknown
  double speed_mbit_s = 0;  // nominal; 0: unknown
  double usable = 1;        // the fraction of it that images can have
};

struct ConnectedCamera {
  std::string key;                 // of a source in a deployment file: v4l2 or genicam
  std::string value;               // of this key
  std::string title;               // maker and model
  std::vector<std::string> facts;  // further lines about it
  std::vector<CameraMode> modes;
  CameraLink link;
};

}  // namespace fivepipe::capture
