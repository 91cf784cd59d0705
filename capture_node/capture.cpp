#include "capture_node/capture.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <thread>

#include "capture_node/lens/undistortion.h"
#include "capture_node/object_colour.h"
#include "capture_node/object_finder.h"
#include "capture_node/sources/frozen_camera.h"
#include "capture_node/sources/open_source.h"
#include "common/base/realtime.h"
#include "common/base/timing.h"
#include "common/hull/coverage/thin_coverage.h"
#include "common/hull/silhouette_bounds.h"

namespace fivepipe::capture {
namespace {

// Between attempts to read a camera for which capture waits.
constexpr std::chrono::milliseconds kRetryPeriod{20};

// Cameras with an image without which `lost_camera: continue` sends no set.
constexpr std::size_t kMinCameras = 2;

// Leaves the other cores to the other nodes.
constexpr std::size_t kMaxThreads = 2;

// Returns the image without its alpha channel. Returns an empty image if it is not 8-bit BGR or
// BGRA.
cv::Mat bgr_of(const cv::Mat& image) {
  if (image.type() == CV_8UC3) return image;
  if (image.type() != CV_8UC4) return {};
  cv::Mat bgr(image.rows, image.cols, CV_8UC3);
  const int channels[] = {0, 0, 1, 1, 2, 2};
  cv::mixChannels(&image, 1, &bgr, 1, channels, 3);
  return bgr;
}

// Margin around the hull's footprint: one pixel for bilinear interpolation, and one for rounding.
constexpr int kColourMargin_px = 2;

}  // namespace

struct Capture::Channel {
  const config::RigCamera* camera;
  std::unique_ptr<ImageSource> source;
  std::unique_ptr<Undistortion> undistortion;
  // Only cameras that give shape have these: how their objects are found, and the captured pixels
  // that the published image does not contain.
  std::unique_ptr<ObjectFinder> finder;
  FrozenCamera frozen;
  hull::ObjectPixels outside_published;
  bool is_silent = false;  // no image of it arrived for the last frame
  // Only the other cameras have it: the published pixels that the captured image sees.
  hull::ObjectPixels seen;
};

Capture::Capture(const config::Rig& rig, const config::Viewer& viewer,
                 const config::CaptureConfig& config, double frame_rate_hz,
                 const Progress& progress, std::vector<config::Viewer> spectators)
    : rig_(rig),
      viewer_(viewer),
      colour_viewers_(std::move(spectators)),
      config_(config),
      frame_rate_hz_(frame_rate_hz),
      pool_(int(std::clamp<std::size_t>(config.sources.size(), 1, kMaxThreads))) {
  cv::setNumThreads(1);
  colour_viewers_.push_back(viewer_);
  for (const config::RigCamera& camera : rig_.cameras) {
    if (!config_.sources.contains(camera.name)) continue;
    channels_.push_back(std::make_unique<Channel>());
    channels_.back()->camera = &camera;
  }
  open_channels(progress);
  precompute(progress);
}

void Capture::open_channels(const Progress& progress) {
  SyntheticSettings synthetic{
      frame_rate_hz_, [this](double t_s) { return config::eye_from_world_at(viewer_, t_s); }, {}};
  for (const auto& [camera, source] : config_.sources)
    if (std::holds_alternative<config::SyntheticSource>(source) && !synthetic.surroundings)
      synthetic.surroundings = std::make_shared<const Surroundings>(config_.synthetic.seed);
  std::mutex mutex;
  std::size_t done = 0;
  std::vector<SourceProblem> problems;
  base::in_parallel(pool_, channels_.size(), [&](std::size_t i) {
    Channel& channel = *channels_[i];
    const std::string& name = channel.camera->name;
    std::vector<SourceProblem> of_camera;
    try {
      channel.source = open_source(*channel.camera, config_, synthetic);
      prepare(channel);
    } catch (const SourceError& error) {
      of_camera = error.problems();
    } catch (const std::exception& error) {  // thrown by OpenCV
      of_camera = {{name, SourceFault::not_decodable, error.what()}};
    }
    const std::lock_guard lock(mutex);
    problems.insert(problems.end(), of_camera.begin(), of_camera.end());
    ++done;
    if (progress)
      progress("camera " + name + ": source and background",
               double(done) / double(channels_.size()));
  });
  if (!problems.empty()) throw_problems(std::move(problems));
}

void Capture::precompute(const Progress& progress) {
  const std::size_t frames = std::size_t(std::max(0, config_.precomputed_frames));
  while (precomputed_.size() < frames) {
    std::vector<CapturedCamera> next = capture_live(std::int64_t(precomputed_.size()), true, 0);
    if (ended_) break;
    precomputed_.push_back(std::move(next));
    if (progress) progress("precomputing frames", double(precomputed_.size()) / double(frames));
  }
  ended_ = false;
}

// All devices end at the same time, so that a node with several of them ends in time.
Capture::~Capture() {
  for (const std::unique_ptr<Channel>& channel : channels_)
    if (channel->source) channel->source->stop();
}

void Capture::prepare(Channel& channel) const {
  const config::RigCamera& camera = *channel.camera;
  channel.undistortion = std::make_unique<Undistortion>(camera);
  if (camera.gives_shape) {
    // Published pixels that the lens does not show are no object pixels.
    if (config_.hull_rule.limits == hull::Limits::seen && !channel.undistortion->sees_all())
      throw_problems({{camera.name, SourceFault::wrong_size,
                       "with hull limits: seen, its lens must show the whole published image, "
                       "or objects end at the edge of the lens: set `published` in the rig to a "
                       "part that it shows"}});
    channel.finder = open_object_finder(camera, config_, *channel.source, frame_rate_hz_);
    channel.outside_published = outside_published(camera);
    return;
  }
  const geometry::Pinhole& published = camera.published;
  channel.seen = {published.width_px, published.height_px};
  for (int v = 0; v < published.height_px; ++v)
    for (int u = 0; u < published.width_px; ++u)
      if (channel.undistortion->sees(u, v)) channel.seen.set(u, v);
}

// One camera's image of a frame.
struct Capture::RawCapture {
  CapturedCamera result;
  std::optional<ReadStatus> status;  // nullopt: the camera is not read
  std::int64_t taken_ns = 0;         // 0: the source has no clock
  cv::Mat image;                     // empty if there is none, or if nothing is computed from it
  geometry::Camera published;
  bool is_lost = false;  // the camera gives shape and may deliver again
};

// Number of the cameras that give shape and that other nodes read.
std::size_t Capture::cameras_of_others() const {
  return std::size_t(
      std::count_if(rig_.cameras.begin(), rig_.cameras.end(), [&](const config::RigCamera& camera) {
        return camera.gives_shape && !config_.sources.contains(camera.name);
      }));
}

// With config.lost_camera `continue` and hull limits `all`: sets every pixel of the cameras without
// an image. One camera bounds no hull, so a node that reads all cameras of the rig then sends
// nothing. With limits `seen`, such a camera would see an object everywhere: it has no map, and the
// readers go on without it (frames::FrameSetAssembler).
void Capture::go_on_without_lost(std::vector<RawCapture>& raw_captures) const {
  if (config_.lost_camera != config::LostCamera::go_on) return;
  const auto with_image =
      std::size_t(std::count_if(raw_captures.begin(), raw_captures.end(),
                                [](const RawCapture& one) { return one.result.pixels; }));
  // The timestamp of a map without an image adds nothing to the skew of the set.
  std::int64_t earliest_ns = INT64_MAX;
  for (const RawCapture& one : raw_captures)
    if (one.result.pixels) earliest_ns = std::min(earliest_ns, one.result.image_stamp_ns);
  const std::size_t shapes = config::shape_cameras(rig_).size();
  const bool is_enough = cameras_of_others() > 0 || with_image >= std::min(kMinCameras, shapes);
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    CapturedCamera& result = raw_captures[i].result;
    if (!channels_[i]->finder || result.status != CaptureStatus::missing) continue;
    result.reason +=
        is_enough ? "; the hull goes on without it" : "; too few cameras have an image for a hull";
    if (!is_enough || config_.hull_rule.limits == hull::Limits::seen) continue;
    const geometry::Pinhole& published = channels_[i]->camera->published;
    if (with_image > 0) result.image_stamp_ns = earliest_ns;
    result.pixels.emplace(published.width_px, published.height_px);
    for (int v = 0; v < published.height_px; ++v) result.pixels->set_run(0, published.width_px, v);
  }
}

// With config.lost_camera `wait`: waits until each lost camera delivers again. Returns true if it
// did, and all cameras must be read again, so that the images of the set are of one time.
bool Capture::waited_for_lost(const std::vector<RawCapture>& raw_captures, std::int64_t index) {
  if (config_.lost_camera != config::LostCamera::wait || !go_on_waiting_) return false;
  bool has_waited = false;
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    if (!raw_captures[i].is_lost) continue;
    ImageSource& source = *channels_[i]->source;
    cv::Mat image;
    do {
      if (!go_on_waiting_(channels_[i]->camera->name, source.last_error())) return false;
      std::this_thread::sleep_for(kRetryPeriod);  // the next call does not wait for a lost camera
      source.wait_for_image(std::chrono::steady_clock::now() + kImageTimeout);
    } while (source.read(index, image) == ReadStatus::missing && source.is_live());
    channels_[i]->is_silent = false;
    has_waited = true;
  }
  return has_waited;
}

bool Capture::is_read(const Channel& channel, bool want_colour) {
  return channel.finder || (want_colour && channel.camera->gives_colour);
}

// Waits for the cameras together. A camera that was silent before does not delay the others again.
void Capture::wait_for_images(bool want_colour) const {
  const auto now = std::chrono::steady_clock::now();
  for (const std::unique_ptr<Channel>& channel : channels_)
    if (is_read(*channel, want_colour))
      channel->is_silent =
          !channel->source->wait_for_image(channel->is_silent ? now : now + kImageTimeout);
}

void Capture::read_image(Channel& channel, std::int64_t index, RawCapture& raw_capture) {
  const auto start = std::chrono::steady_clock::now();
  raw_capture.status = channel.source->read(index, raw_capture.image);
  if (raw_capture.status == ReadStatus::image) raw_capture.taken_ns = channel.source->stamp_ns();
  raw_capture.result.read_s = base::seconds_since(start);
}

// Reads the newest image of each device, which takes no time, one after the other, so that they are
// of one time. Decodes files and segments in parallel.
std::vector<Capture::RawCapture> Capture::capture_all(std::int64_t frame, std::int64_t index,
                                                      std::int64_t stamp_ns, bool want_colour) {
  wait_for_images(want_colour);
  const std::int64_t now_ns = stamp_ns ? stamp_ns : base::now_realtime_ns();
  std::vector<RawCapture> raw_captures(channels_.size());
  for (std::size_t i = 0; i < channels_.size(); ++i)
    if (is_read(*channels_[i], want_colour) && channels_[i]->source->is_live())
      read_image(*channels_[i], index, raw_captures[i]);
  base::in_parallel(pool_, channels_.size(), [&](std::size_t i) {
    if (is_read(*channels_[i], want_colour) && !raw_captures[i].status)
      read_image(*channels_[i], index, raw_captures[i]);
    segment(*channels_[i], frame, index, now_ns, raw_captures[i]);
  });
  return raw_captures;
}

void Capture::segment(Channel& channel, std::int64_t frame, std::int64_t index, std::int64_t now_ns,
                      RawCapture& raw_capture) const {
  const config::RigCamera& camera = *channel.camera;
  CapturedCamera& result = raw_capture.result;
  result.camera = camera.name;
  raw_capture.published = config::published_camera(
      camera, config::eye_from_world_at(viewer_, double(frame) / frame_rate_hz_));
  if (!raw_capture.status) return;
  result.image_stamp_ns = raw_capture.taken_ns ? raw_capture.taken_ns : now_ns;
  result.has_clock = raw_capture.taken_ns != 0;
  if (raw_capture.status != ReadStatus::image) {
    const bool has_ended = raw_capture.status == ReadStatus::end;
    result.status = has_ended ? CaptureStatus::ended : CaptureStatus::missing;
    result.reason = has_ended ? "its images have ended" : channel.source->last_error();
    raw_capture.is_lost = channel.finder && !has_ended && channel.source->is_live();
    return;
  }
  if (channel.source->is_live())
    if (const double s = channel.frozen.frozen_s(raw_capture.image, base::now_realtime_ns());
        s >= kMinFrozen_s)
      result.diagnostics.push_back("frozen: it sends the same image again and again");
  if (!channel.finder) {
    raw_capture.image = bgr_of(raw_capture.image);
    if (raw_capture.image.empty()) {
      result.status = CaptureStatus::missing;
      result.reason = "the image is not 8-bit BGR";
    }
    return;
  }
  const auto segment_start = std::chrono::steady_clock::now();
  const double cpu_before_s = base::thread_cpu_s();
  const ObjectFinder::Found found = channel.finder->find(raw_capture.image, index);
  if (found.segmentation)
    result.pixels = channel.undistortion->published(found.segmentation->object);
  if (found.segmentation && found.segmentation->coverage)
    result.outline =
        hull::preserve_thin(channel.undistortion->published(*found.segmentation->coverage))
            .outline(*result.pixels);
  result.segment_s = base::seconds_since(segment_start);
  result.segment_cpu_s = base::thread_cpu_s() - cpu_before_s;
  if (!found.segmentation) {
    result.status = found.ended ? CaptureStatus::ended : CaptureStatus::missing;
    result.reason = found.reason;
    raw_capture.image.release();
    return;
  }
  raw_capture.image = bgr_of(raw_capture.image);
  const hull::ObjectPixels& captured = found.segmentation->object;
  if (observer_) observer_(camera, raw_capture.image, *found.segmentation);
  if (found.all_outside)
    result.diagnostics.push_back(
        "all its object pixels are outside of `volume_m` or `regions` of segmentation: its pose, "
        "volume_m or the region is wrong");
  for (std::string& text :
       segmentation_diagnostics(*result.pixels, captured.count_common(channel.outside_published),
                                config_.hull_rule.limits))
    result.diagnostics.push_back(std::move(text));
}

void Capture::add_colours(std::int64_t frame, std::vector<RawCapture>& raw_captures) {
  std::vector<hull::SilhouetteBounds> parts;
  for (const RawCapture& raw_capture : raw_captures)
    if (raw_capture.result.pixels)
      parts.push_back({raw_capture.published, raw_capture.result.pixels->bounds()});
  const auto no_object =
      std::count_if(parts.begin(), parts.end(),
                    [](const hull::SilhouetteBounds& seen) { return seen.part.empty(); });
  const bool all = config_.hull_rule.limits == hull::Limits::all;
  const auto may_see = std::ssize(parts) - no_object + std::ptrdiff_t(cameras_of_others());
  if (all ? no_object > 0 : may_see < config_.hull_rule.min_seen) return;  // the hull is empty
  if (!all) parts.clear();  // the hull may extend beyond what a camera sees
  const std::vector<VisibleRegion> eyes = visible_regions(
      colour_viewers_, double(frame) / frame_rate_hz_, config_.hull_rule.within_world_m);
  base::in_parallel(pool_, raw_captures.size(), [&](std::size_t i) {
    RawCapture& raw_capture = raw_captures[i];
    const Channel& channel = *channels_[i];
    if (!channel.camera->gives_colour || raw_capture.image.empty()) return;
    const auto start = std::chrono::steady_clock::now();
    const double cpu_before_s = base::thread_cpu_s();
    hull::ObjectPixels pixels =
        raw_capture.result.pixels
            ? *raw_capture.result.pixels
            : visible_footprint(parts, eyes, raw_capture.published, kColourMargin_px);
    if (!raw_capture.result.pixels) pixels.keep(channel.seen);
    if (pixels.count() > 0)
      raw_capture.result.colour = colours_of(std::move(pixels), raw_capture.published,
                                             *channel.undistortion, raw_capture.image);
    raw_capture.result.segment_s += base::seconds_since(start);
    raw_capture.result.segment_cpu_s += base::thread_cpu_s() - cpu_before_s;
  });
}

// The number of frames of the shortest file, if it is at most `up_to`. Also of files that are not
// read now, so that all nodes of a deployment find the same number.
std::optional<std::int64_t> Capture::shortest_length(std::int64_t up_to) {
  std::optional<std::int64_t> shortest;
  for (const std::unique_ptr<Channel>& channel : channels_)
    for (const std::optional<std::int64_t>& length :
         {channel->source->length(up_to),
          channel->finder ? channel->finder->length(up_to) : std::nullopt})
      if (length && *length > 0 && (!shortest || *length < *shortest)) shortest = length;
  return shortest;
}

// stamp_ns: as in capture().
std::vector<CapturedCamera> Capture::capture_live(std::int64_t frame, bool want_colour,
                                                  std::int64_t stamp_ns) {
  std::vector<RawCapture> raw_captures;
  const auto index = [&] { return loop_length_ ? frame % *loop_length_ : frame; };
  const auto capture_again = [&] {
    raw_captures = capture_all(frame, index(), stamp_ns, want_colour);
    ended_ =
        std::any_of(raw_captures.begin(), raw_captures.end(), [](const RawCapture& raw_capture) {
          return raw_capture.result.status == CaptureStatus::ended;
        });
  };
  capture_again();
  // All files begin again together after the shortest one, so that one set never combines frames of
  // different times. From the end of a file that is read on, the frame number alone decides which
  // images a set has, also in a node that skips frames or starts later than others.
  if (ended_ && config_.loop && !loop_length_ && (loop_length_ = shortest_length(frame)))
    capture_again();
  while (!ended_ && waited_for_lost(raw_captures, index())) capture_again();
  go_on_without_lost(raw_captures);
  if (want_colour) add_colours(frame, raw_captures);
  std::vector<CapturedCamera> result;
  for (RawCapture& raw_capture : raw_captures) result.push_back(std::move(raw_capture.result));
  return result;
}

std::vector<CapturedCamera> Capture::capture(std::int64_t frame, bool want_colour,
                                             std::int64_t stamp_ns) {
  if (precomputed_.empty()) return capture_live(frame, want_colour, stamp_ns);
  if (stamp_ns == 0) stamp_ns = base::now_realtime_ns();
  std::vector<CapturedCamera> result = precomputed_[std::size_t(frame) % precomputed_.size()];
  for (CapturedCamera& camera : result) {
    if (!want_colour) camera.colour.reset();
    camera.read_s = camera.segment_s = camera.segment_cpu_s = 0;
    camera.image_stamp_ns = stamp_ns;
    camera.has_clock = false;
  }
  return result;
}

}  // namespace fivepipe::capture
