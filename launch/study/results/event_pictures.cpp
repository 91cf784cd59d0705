#include "launch/study/results/event_pictures.h"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "common/pipeline/bus/topics.h"
#include "common/recording/schema/cdr_cursor.h"

namespace fivepipe::study {
namespace {

constexpr std::uint32_t kMaxViewerName = 32;
constexpr int kMaxWidth_px = 320;
// render_node repeats a picture for missing frames in gaps up to this.
constexpr double kMaxRepeat_s = 1.0;

std::vector<std::uint64_t> composited_frames(const recording::Recording& recording) {
  std::set<mcap::Id> channels;
  for (const recording::RecordedChannel& channel : recording.channels())
    if (channel.topic == bus::topics::FrameComposited::name && !channel.key_states)
      channels.insert(channel.id);
  std::vector<std::uint64_t> frames;
  if (channels.empty() || !recording.type_differences(channels).empty()) return frames;
  auto messages = recording.messages(recording.start_ns(), recording.end_ns(), channels);
  for (;;) try {
      const auto message = messages.next();
      if (!message) return frames;
      if (message->key_change) continue;
      schema::CdrCursor cursor(message->cdr);
      cursor.take_string(kMaxViewerName);
      frames.push_back(cursor.take<std::uint64_t>());
    } catch (const mcap::McapError&) {
    } catch (const schema::CdrFault&) {
    }
}

}  // namespace

struct EventPictures::Video {
  cv::VideoCapture capture;
};

EventPictures::EventPictures(const recording::Recording& recording,
                             const std::filesystem::path& video)
    : video_(std::make_unique<Video>()) {
  if (!std::filesystem::exists(video) || !video_->capture.open(video.string(), cv::CAP_FFMPEG)) {
    why_none_ = video.string() + " cannot be read";
    return;
  }
  rate_hz_ = video_->capture.get(cv::CAP_PROP_FPS);
  int index = 0;
  std::uint64_t last = 0;
  for (const std::uint64_t frame : composited_frames(recording)) {
    if (!index_of_frame_.empty()) {
      const double gap_s = double(frame - last) / rate_hz_;
      index += gap_s <= kMaxRepeat_s ? int(frame - last) : 1;
    }
    index_of_frame_[frame] = index;
    last = frame;
  }
  if (index_of_frame_.empty()) why_none_ = "the recording states no composited frames";
}

EventPictures::~EventPictures() = default;

std::string EventPictures::png_of(std::uint64_t frame) const {
  const auto after = index_of_frame_.upper_bound(frame);
  if (after == index_of_frame_.begin() || !video_->capture.isOpened()) return "";
  if (double(frame - std::prev(after)->first) > kMaxRepeat_s * rate_hz_) return "";
  cv::Mat image;
  if (!video_->capture.set(cv::CAP_PROP_POS_FRAMES, std::prev(after)->second) ||
      !video_->capture.read(image) || image.empty())
    return "";
  const double scale = double(kMaxWidth_px) / image.cols;
  if (scale < 1) cv::resize(image, image, {}, scale, scale, cv::INTER_AREA);
  std::vector<std::uint8_t> png;
  if (!cv::imencode(".png", image, png)) return "";
  return {png.begin(), png.end()};
}

}  // namespace fivepipe::study
