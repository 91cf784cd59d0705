// Sends composited frames to the video, the still image and the window. Uses neither DDS nor
// OpenGL.
#pragma once
#include <cstdint>
#include <filesystem>
#include <future>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "common/config/deployment.h"
#include "render_node/output/outputs.h"
#include "render_node/output/window.h"

namespace fivepipe::render {

class Presenter {
 public:
  // Creates the folder `out` if needed and writes the files into it: composite.png and
  // composite.mp4, or composite_NAME.* for the spectator `viewer`. Writes no files if `out` is
  // empty. The video opens in another thread. Throws OutputError or WindowError.
  Presenter(const config::RenderConfig& config, const config::Viewer& viewer, double frame_rate_hz,
            const std::filesystem::path& out);

  // Waits until the video is open. Throws OutputError.
  void wait_until_open() {
    if (video_) video_->wait_until_open();
  }

  // Returns true if present() would use this frame: there is a video or a window, or this frame is
  // the still. The caller need not read back other frames.
  bool wants(std::uint64_t frame) const {
    return video_ || window_ || (needs_still() && std::int64_t(frame) >= config_.still_frame);
  }
  bool needs_still() const { return !out_.empty() && !still_begun_; }

  // The caller must not modify image_bgr afterwards. The video keeps capture time: it repeats the
  // previous image for each missing frame. when_full: what happens if the video's encoder is slower
  // than the frames. Another thread writes the still. Throws OutputError if it could not. Returns
  // false after the user has closed the window.
  bool present(std::uint64_t frame, const cv::Mat& image_bgr, WhenFull when_full = WhenFull::drop);

  Window* window() { return window_.get(); }  // nullptr: there is none

  // Closes the video. Writes the last presented frame as the still if there is none, and waits for
  // the still.
  // Throws OutputError.
  void finish();

  std::uint64_t video_frames_dropped() const { return video_ ? video_->dropped() : 0; }

 private:
  void add_to_video(std::uint64_t frame, const cv::Mat& image_bgr, WhenFull when_full);

  config::RenderConfig config_;
  std::filesystem::path out_;
  const std::string name_;  // of the files, without extension
  double frame_rate_hz_;
  std::unique_ptr<VideoFile> video_;
  std::unique_ptr<Window> window_;
  std::future<void> still_;  // of the thread that writes the still; valid until it is taken
  bool still_begun_ = false;
  std::uint64_t last_frame_ = 0;
  cv::Mat last_image_;
};

}  // namespace fivepipe::render
