#include "render_node/output/presenter.h"

namespace fivepipe::render {
namespace {

// The video skips a longer gap instead of filling it with one repeated image.
constexpr double kMaxRepeat_s = 1.0;

// Returns STEM.EXT, or STEM-2.EXT and so on if the file exists, so that a restarted process does
// not replace the video of its predecessor.
std::filesystem::path unused_name(const std::filesystem::path& folder, const std::string& stem,
                                  const std::string& extension) {
  std::filesystem::path file = folder / (stem + extension);
  for (int number = 2; std::filesystem::exists(file); ++number)
    file = folder / (stem + "-" + std::to_string(number) + extension);
  return file;
}

// PNG compresses for many milliseconds, which no frame shall wait for.
void write_still(const std::filesystem::path& file, const cv::Mat& image_bgr) {
  lower_priority();
  write_png(file, image_bgr);
}

}  // namespace

Presenter::Presenter(const config::RenderConfig& config, const config::Viewer& viewer,
                     double frame_rate_hz, const std::filesystem::path& out)
    : config_(config),
      out_(out),
      name_(config.viewer ? "composite_" + viewer.name : "composite"),
      frame_rate_hz_(frame_rate_hz) {
  const cv::Size size_px(config::composite_width_px(viewer), viewer.render_height_px);
  if (!out_.empty()) std::filesystem::create_directories(out_);
  if (!out_.empty() && config_.video) {
    VideoOptions options;
    options.frame_rate_hz = frame_rate_hz;
    video_ = std::make_unique<VideoFile>(unused_name(out_, name_, ".mp4"), size_px, options);
  }
  if (config_.window)
    window_ = std::make_unique<Window>(config.viewer ? "fivepipe " + viewer.name : "fivepipe",
                                       size_px.width, size_px.height);
}

void Presenter::add_to_video(std::uint64_t frame, const cv::Mat& image_bgr, WhenFull when_full) {
  // Unsigned, so that a lower number of a restarted source is a long gap.
  const double gap_s = double(frame - last_frame_) / frame_rate_hz_;
  if (!last_image_.empty() && gap_s <= kMaxRepeat_s)
    for (std::uint64_t missing = last_frame_ + 1; missing < frame; ++missing)
      video_->add(last_image_, when_full);
  video_->add(image_bgr, when_full);
}

bool Presenter::present(std::uint64_t frame, const cv::Mat& image_bgr, WhenFull when_full) {
  if (video_) add_to_video(frame, image_bgr, when_full);
  if (needs_still() && std::int64_t(frame) >= config_.still_frame) {
    still_ = std::async(std::launch::async, write_still, out_ / (name_ + ".png"), image_bgr);
    still_begun_ = true;
  }
  if (still_.valid() && still_.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
    still_.get();
  last_frame_ = frame;
  last_image_ = image_bgr;
  return !window_ || window_->show(image_bgr);
}

void Presenter::finish() {
  if (needs_still() && !last_image_.empty()) write_png(out_ / (name_ + ".png"), last_image_);
  if (still_.valid()) still_.get();
  if (video_) video_->finish();
}

}  // namespace fivepipe::render
