// The image source of any camera of a deployment.
#pragma once
#include <memory>

#include "capture_node/sources/synthetic_source.h"
#include "common/config/capture/capture_config.h"

namespace fivepipe::capture {

// What the synthetic cameras of a node share.
struct SyntheticSettings {
  double frame_rate_hz;
  SyntheticImageSource::EyePath eye;
  std::shared_ptr<const Surroundings> surroundings;  // null without synthetic cameras
};

// Opens the source that config.sources names for the camera. Throws SourceError or HardwareMissing.
std::unique_ptr<ImageSource> open_source(const config::RigCamera& camera,
                                         const config::CaptureConfig& config,
                                         const SyntheticSettings& synthetic);

}  // namespace fivepipe::capture
