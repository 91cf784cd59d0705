#include "render_node/output/video_module.h"

#include "render_node/output/video_encoder.h"

extern "C" void fivepipe_make_video_encoder(
    const std::filesystem::path& file, cv::Size size_px, double frame_rate_hz,
    std::unique_ptr<fivepipe::render::VideoWriter>& writer) {
  writer = std::make_unique<fivepipe::render::VideoEncoder>(file, size_px, frame_rate_hz);
}
