// The module fivepipe_video.so: writes a video by FFmpeg. render_node loads it when a view has a
// video.
#pragma once
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>

#include "common/base/process/optional_module.h"

namespace fivepipe::render {

// A video file that is being written (video_encoder.h).
class VideoWriter {
 public:
  virtual ~VideoWriter() = default;
  virtual void write(const cv::Mat& image_bgr) = 0;
  virtual void finish() = 0;
};

inline constexpr base::OptionalModule kVideoModule{"fivepipe_video.so", "FFmpeg",
                                                   "libavformat-dev and libavcodec-dev"};

// Creates a VideoEncoder; throws as its constructor does.
inline constexpr const char* kMakeVideoEncoder = "fivepipe_make_video_encoder";
using MakeVideoEncoder = void(const std::filesystem::path& file, cv::Size size_px,
                              double frame_rate_hz, std::unique_ptr<VideoWriter>& writer);

}  // namespace fivepipe::render
