// Where composited frames go: the video, the still, the window. Pure of DDS and of OpenGL.
#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "common/config/deployment.h"
#include "render_node/outputs.h"
#include "render_node/window.h"

namespace fivepipe::render {

class Presenter {
 public:
  // Files go to `out` (made where missing); an empty path: none are written. Throws OutputError or
  // WindowError.
  Presenter(const config::RenderConfig& config, const config::Viewer& viewer, double frame_rate_hz,
            const std::filesystem::path& out);

  // Whether frames are looked at one and all, or this one is the still: otherwise nothing is made
  // of it, and it need not be read back.
  bool wants(std::uint64_t frame) const {
    return video_ || window_ || (needs_still() && std::int64_t(frame) >= config_.still_frame);
  }
  bool needs_still() const { return !out_.empty() && !still_written_; }

  // image_bgr must not be written to afterwards. The video keeps the footage's time: a frame that
  // is missing repeats the one before. False once the window was closed.
  bool present(std::uint64_t frame, const cv::Mat& image_bgr);

  // Closes the video; writes the frame presented last as the still where its frame never came.
  // Throws OutputError.
  void finish();

  std::uint64_t video_frames_dropped() const { return video_ ? video_->dropped() : 0; }

 private:
  void add_to_video(std::uint64_t frame, const cv::Mat& image_bgr);

  config::RenderConfig config_;
  std::filesystem::path out_;
  double frame_rate_hz_;
  std::unique_ptr<VideoFile> video_;
  std::unique_ptr<Window> window_;
  bool still_written_ = false;
  std::uint64_t last_frame_ = 0;
  cv::Mat last_image_;
};

}  // namespace fivepipe::render
