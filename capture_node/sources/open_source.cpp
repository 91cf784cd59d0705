#include "capture_node/sources/open_source.h"

#include <stdexcept>

namespace fivepipe::capture {

std::unique_ptr<ImageSource> open_source(const config::RigCamera& camera,
                                         const config::CaptureConfig& config,
                                         const SyntheticSettings& synthetic) {
  const config::CameraSource& source = config.sources.at(camera.name);
  if (const auto* video = std::get_if<config::VideoSource>(&source))
    return open_file_source(camera, *video);
  if (const auto* device = std::get_if<config::V4l2Source>(&source))
    return open_v4l2_source(camera, *device);
  if (const auto* pipeline = std::get_if<config::GstreamerSource>(&source))
    return open_gstreamer_source(camera, *pipeline);
  if (const auto* stream = std::get_if<config::RtspSource>(&source))
    return open_rtsp_source(camera, *stream);
  if (const auto* genicam = std::get_if<config::GenicamSource>(&source))
    return open_genicam_source(camera, *genicam);
  if (std::holds_alternative<config::SyntheticSource>(source)) {
    auto opened = std::make_unique<SyntheticImageSource>(
        config.synthetic, camera, synthetic.frame_rate_hz, synthetic.eye, synthetic.surroundings);
    if (config.synthetic.prerender && config.precomputed_frames <= 0) opened->prerender();
    return opened;
  }
  throw std::logic_error("camera " + camera.name +
                         ": open_source() does not handle the type of its source");
}

}  // namespace fivepipe::capture
