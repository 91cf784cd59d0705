#include "capture_node/capture.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <exception>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>

#include "capture_node/image_source.h"
#include "capture_node/segmentation.h"
#include "capture_node/synthetic_source.h"
#include "common/clock/realtime.h"

namespace fivepipe {
namespace {

constexpr unsigned kMostThreads = 2;  // the other cores are the other pipes'

// Calls `work(i)` for i < count, on up to kMostThreads threads; the caller's is one of them. Rethrows the first exception once all are done.
template <class Work>
void in_parallel(std::size_t count, const Work& work) {
  std::atomic<std::size_t> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto run = [&] {
    for (std::size_t i; (i = next++) < count;) try {
        work(i);
      } catch (...) {
        const std::lock_guard lock(mutex);
        if (!failure) failure = std::current_exception();
      }
  };
  {
    std::vector<std::jthread> others;
    const std::size_t threads = std::min<std::size_t>({count, kMostThreads, std::max(1u, std::thread::hardware_concurrency())});
    for (std::size_t i = 1; i < threads; ++i) others.emplace_back(run);
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

PixelRect grown(const PixelRect& rect, int by_px, const Pinhole& image) {
  return intersection({rect.u0_px - by_px, rect.v0_px - by_px, rect.u1_px + by_px, rect.v1_px + by_px}, {0, 0, image.width_px, image.height_px});
}

ColourRegion colour_region(const Camera& camera, const Undistortion& undistortion, const cv::Mat& image, const PixelRect& region) {
  ColourRegion colour{camera, region, std::vector<std::uint8_t>(3 * region.area_px())};
  const cv::Mat bgr = undistortion.published(image, region);
  const std::size_t row_bytes = 3 * std::size_t(region.width_px());
  for (int v = 0; v < region.height_px(); ++v) std::memcpy(colour.bgr.data() + std::size_t(v) * row_bytes, bgr.ptr(v), row_bytes);
  return colour;
}

}  // namespace

PixelRect projection_of(const Eigen::AlignedBox3d& box_m, const Camera& camera) {
  const PixelRect image{0, 0, camera.pinhole.width_px, camera.pinhole.height_px};
  Eigen::AlignedBox2d bounds;
  for (int corner = 0; corner < 8; ++corner) {
    const std::optional<Eigen::Vector2d> uv = project(camera, box_m.corner(Eigen::AlignedBox3d::CornerType(corner)));
    if (!uv) return image;
    bounds.extend(*uv);
  }
  const Eigen::AlignedBox2d seen = bounds.intersection(Eigen::AlignedBox2d(Eigen::Vector2d(-0.5, -0.5), Eigen::Vector2d(image.u1_px, image.v1_px)));
  if (seen.isEmpty()) return {};
  return intersection(image, {int(std::floor(seen.min().x() + 0.5)), int(std::floor(seen.min().y() + 0.5)),
                              int(std::floor(seen.max().x() + 0.5)) + 1, int(std::floor(seen.max().y() + 0.5)) + 1});
}

struct Capture::Channel {
  const RigCamera* camera;
  std::unique_ptr<ImageSource> source;
  std::string background;     // file; empty where the source itself shows the empty scene first
  int background_frames = 0;  // then: how many of its images
  std::unique_ptr<Undistortion> undistortion;  // of cameras without a segmenter
  std::unique_ptr<Segmenter> segmenter;
};

Capture::Capture(const Rig& rig, const Viewer& viewer, const CaptureConfig& config, double frame_rate_hz, Progress progress)
    : rig_(rig), viewer_(viewer), config_(config), frame_rate_hz_(frame_rate_hz) {
  cv::setNumThreads(1);
  std::shared_ptr<const Surroundings> surroundings;
  const auto eye_at = [this](double t_s) { return eye_from_world_at(viewer_, t_s); };
  for (const RigCamera& camera : rig_.cameras) {
    const auto source = config_.sources.find(camera.name);
    if (source == config_.sources.end()) continue;
    auto channel = std::make_unique<Channel>();
    channel->camera = &camera;
    if (std::holds_alternative<SyntheticSource>(source->second) && !surroundings)
      surroundings = std::make_shared<const Surroundings>(config_.synthetic.seed);
    channels_.push_back(std::move(channel));
  }

  std::mutex mutex;
  std::size_t done = 0;
  std::vector<SourceProblem> problems;
  const auto step = [&](const std::string& what, std::size_t of) {
    const std::lock_guard lock(mutex);
    ++done;
    if (progress) progress(what, double(done) / double(of));
  };
  in_parallel(channels_.size(), [&](std::size_t i) {
    Channel& channel = *channels_[i];
    const RigCamera& camera = *channel.camera;
    try {
      const CameraSource& source = config_.sources.at(camera.name);
      if (const auto* video = std::get_if<VideoSource>(&source)) {
        channel.source = open_file_source(camera, *video);
        channel.background = video->background;
      } else if (const auto* device = std::get_if<V4l2Source>(&source)) {
        channel.source = open_v4l2_source(camera, *device);
        channel.background = device->background;
        channel.background_frames = device->background_frames;
      } else {
        auto synthetic = std::make_unique<SyntheticImageSource>(config_.synthetic, camera, frame_rate_hz_, eye_at, surroundings);
        if (config_.synthetic.render_ahead && config_.premade_frames <= 0) synthetic->render_ahead();
        channel.source = std::move(synthetic);
      }
      learn(channel);
    } catch (const SourceError& error) {
      const std::lock_guard lock(mutex);
      problems.insert(problems.end(), error.problems().begin(), error.problems().end());
    } catch (const std::exception& error) {  // OpenCV's own
      const std::lock_guard lock(mutex);
      problems.push_back({camera.name, SourceFault::not_decodable, error.what()});
    }
    step("camera " + camera.name + ": reference image", channels_.size());
  });
  if (!problems.empty()) throw_problems(std::move(problems));
  if (config_.premade_frames <= 0) return;

  done = 0;
  for (int frame = 0; frame < config_.premade_frames && !ended_; ++frame) {
    premade_.push_back(captured_now(frame, true));
    step("segmenting ahead", std::size_t(config_.premade_frames));
  }
  ended_ = false;
}

Capture::~Capture() = default;

void Capture::learn(Channel& channel) const {
  const RigCamera& camera = *channel.camera;
  if (!camera.gives_shape) {
    channel.undistortion = std::make_unique<Undistortion>(camera);
    return;
  }
  std::vector<cv::Mat> empty_frames;
  if (!channel.background.empty()) {
    empty_frames = read_background(camera, channel.background);
  } else if (auto* synthetic = dynamic_cast<SyntheticImageSource*>(channel.source.get())) {
    for (int i = 0; i < kSyntheticBackgroundFrames; ++i) empty_frames.push_back(synthetic->background(i));
  } else {
    for (int i = 0; i < channel.background_frames; ++i)
      if (cv::Mat image; channel.source->read(i, image) == ReadStatus::image) empty_frames.push_back(image);
    if (empty_frames.empty())
      throw_problems({{camera.name, SourceFault::no_frames, "no image to learn the empty scene from; " + channel.source->trouble()}});
  }
  channel.segmenter = std::make_unique<Segmenter>(camera, learn_reference(empty_frames), config_.segmentation);
}

CapturedCamera Capture::capture_one(Channel& channel, std::int64_t frame, std::int64_t index, bool want_colour) const {
  const RigCamera& camera = *channel.camera;
  CapturedCamera result;
  result.camera = camera.name;
  want_colour = want_colour && camera.gives_colour;
  if (!channel.segmenter && !want_colour) return result;
  const auto start = std::chrono::steady_clock::now();
  cv::Mat image;
  const ReadStatus status = channel.source->read(index, image);
  result.read_s = seconds_since(start);
  result.image_stamp_ns = now_realtime_ns();
  if (status != ReadStatus::image) {
    result.status = status == ReadStatus::end ? CaptureStatus::ended : CaptureStatus::missing;
    result.reason = status == ReadStatus::end ? "its file is at its end" : channel.source->trouble();
    return result;
  }
  const auto segment_start = std::chrono::steady_clock::now();
  const Camera published = published_camera(camera, eye_from_world_at(viewer_, double(frame) / frame_rate_hz_));
  PixelRect region = projection_of(rig_.volume_m, published);
  const Undistortion& undistortion = channel.segmenter ? channel.segmenter->undistortion() : *channel.undistortion;
  if (channel.segmenter) {
    result.pixels = channel.segmenter->segment(image);
    if (!result.pixels) {
      result.status = CaptureStatus::missing;
      result.reason = "the image is not 8-bit BGR of the rig's size";
      return result;
    }
    result.remarks = remarks_on(*result.pixels);
    region = result.pixels->bounds();
    if (!region.empty()) region = grown(region, kColourMargin_px, camera.published);
  }
  if (want_colour && !region.empty()) result.colour = colour_region(published, undistortion, image, region);
  result.segment_s = seconds_since(segment_start);
  return result;
}

std::vector<CapturedCamera> Capture::captured_now(std::int64_t frame, bool want_colour) {
  if (frame < round_start_) round_start_ = 0;
  std::vector<CapturedCamera> result(channels_.size());
  const auto capture_all = [&] {
    in_parallel(channels_.size(), [&](std::size_t i) { result[i] = capture_one(*channels_[i], frame, frame - round_start_, want_colour); });
    return std::any_of(result.begin(), result.end(), [](const CapturedCamera& camera) { return camera.status == CaptureStatus::ended; });
  };
  ended_ = capture_all();
  // All start over together, with the shortest file: frames of different times are never combined.
  if (ended_ && config_.loop && frame > round_start_) {
    round_start_ = frame;
    ended_ = capture_all();
  }
  return result;
}

std::vector<CapturedCamera> Capture::capture(std::int64_t frame, bool want_colour) {
  if (premade_.empty()) return captured_now(frame, want_colour);
  std::vector<CapturedCamera> result = premade_[std::size_t(frame) % premade_.size()];
  for (CapturedCamera& camera : result) {
    if (!want_colour) camera.colour.reset();
    camera.read_s = camera.segment_s = 0;
    camera.image_stamp_ns = now_realtime_ns();
  }
  return result;
}

std::vector<std::string> Capture::cameras() const {
  std::vector<std::string> names;
  for (const auto& channel : channels_) names.push_back(channel->camera->name);
  return names;
}

}  // namespace fivepipe
