#include "capture_node/publishing_pipe.h"

#include <utility>

#include "common/base/realtime.h"
#include "common/base/timing.h"
#include "common/pipeline/messages/camera_messages.h"
#include "common/pipeline/node/status_names.h"

namespace fivepipe::capture {
namespace {

// Costs of frames older than this no longer represent the scene.
constexpr std::uint64_t kLatelyFrames = 64;

}  // namespace

FramePublisher::FramePublisher(node::NodeContext& node)
    : node_(node),
      config_(node::config_of<config::CaptureConfig>(node)),
      infos_(node.bus.writer<bus::topics::CameraInfo>()),
      colours_(node.bus.writer<bus::topics::ObjectColour>()),
      maps_(node.bus.writer<bus::topics::ObjectPixelMap>()),
      traces_(node.bus, node.status, node.node.name),
      capture_(
          node.deployment.rig, node.deployment.viewer,
          node.every_frame ? config::without_clock(config_) : config_,
          node.deployment.frame_rate_hz,
          [this](std::string_view what, double fraction) { report_progress(what, fraction); },
          config::spectators_of(node.deployment)) {
  capture_.set_go_on_waiting([this](const std::string& camera, const std::string& reason) {
    node_.status.diagnostic("camera " + camera, reason + "; capture waits for it");
    return node::running();
  });
  if (config_.coverage) coverages_.emplace(node.bus.writer<bus::topics::ObjectCoverage>());
  node_.status.start_progress("");
  for (const config::RigCamera& camera : node_.deployment.rig.cameras)
    if (config_.sources.contains(camera.name)) infos_.write(messages::camera_info_message(camera));
}

std::optional<FramePublisher::Set> FramePublisher::capture(std::int64_t frame,
                                                           std::int64_t stamp_ns) {
  Set set;
  set.steps.begin("capture");
  set.frame = std::uint64_t(frame);
  set.start_ns = base::now_realtime_ns();
  set.cameras = capture_.capture(frame, colours_.readers() > 0, stamp_ns);
  use_capture_clock(set.cameras, stamp_ns);
  if (capture_.ended()) return std::nullopt;
  set.cpu_before_publish_s = base::thread_cpu_s();
  set.stamp_ns = earliest_stamp_ns(set.cameras)
                     .value_or(  // no image was read
                         stamp_ns ? stamp_ns : base::now_realtime_ns());
  name_late_cameras(set.cameras, node_.deployment.frame_rate_hz);
  set.steps.begin("publish");
  return set;
}

// The stamps of all capture_nodes are by the clock of the first one's host. Until the clocks are
// compared, an image has the stamp of its frame.
void FramePublisher::use_capture_clock(std::vector<CapturedCamera>& cameras,
                                       std::int64_t stamp_ns) const {
  if (!node_.capture_clock) return;
  const std::optional<std::int64_t> offset_ns = node_.capture_clock->offset_ns();
  for (CapturedCamera& camera : cameras)
    if (camera.has_clock && camera.has_image())
      camera.image_stamp_ns = offset_ns ? camera.image_stamp_ns + *offset_ns : stamp_ns;
}

void FramePublisher::publish(Set set) {
  for (const CapturedCamera& camera : set.cameras) {
    report_camera(camera);
    if (camera.colour)
      colours_.write(
          messages::colour_message(camera.camera, set.frame, camera.image_stamp_ns, *camera.colour)
              .message());
  }
  for (const CapturedCamera& camera : set.cameras)
    if (camera.pixels && coverages_) {
      const hull::ObjectPixels& pixels = *camera.pixels;
      const hull::CoverageOutline whole{{pixels.width_px(), pixels.height_px()}, {}};
      coverages_->write(messages::coverage_message(camera.camera, set.frame, camera.image_stamp_ns,
                                                   camera.outline ? *camera.outline : whole)
                            .message());
    }
  for (const CapturedCamera& camera : set.cameras)
    if (camera.pixels)
      maps_.write(
          messages::map_message(camera.camera, set.frame, camera.image_stamp_ns, *camera.pixels)
              .message());
  node_.status.count(node::kFramesCaptured);
  if (published_) count_cpu(set.cameras, base::thread_cpu_s() - set.cpu_before_publish_s);
  published_ = set.frame;
  // With --every-frame the timestamps are nominal, one period apart.
  if (node_.every_frame)
    node_.status.latency(node::kCaptureToPublished,
                         1e-9 * double(base::now_realtime_ns() - set.start_ns));
  else
    node_.status.latency_since_capture(node::kCaptureToPublished, set.stamp_ns,
                                       base::now_realtime_ns());
  traces_.handled(set.frame, set.stamp_ns, {}, std::move(set.steps));
}

bool FramePublisher::has_published_lately(std::uint64_t frame) const {
  return published_ && frame <= *published_ && *published_ - frame < kLatelyFrames;
}

// Reports in steps of ten percent. start_progress() logs a text only if it is new.
void FramePublisher::report_progress(std::string_view what, double fraction) {
  node_.status.start_progress(std::string(what) + ", " + std::to_string(10 * int(10 * fraction)) +
                              " %");
}

void FramePublisher::count_cpu(const std::vector<CapturedCamera>& cameras, double publish_s) {
  double segment_s = 0;
  for (const CapturedCamera& camera : cameras) segment_s += camera.segment_cpu_s;
  node_.status.count(node::kSegmentationCpu, std::uint64_t(1e6 * segment_s));
  node_.status.count(node::kPublishingCpu, std::uint64_t(1e6 * publish_s));
}

void FramePublisher::report_camera(const CapturedCamera& camera) {
  if (camera.status == CaptureStatus::missing)
    node_.status.drop({"missing_image", camera.camera, ""});
  std::string diagnostics = camera.reason;
  for (const std::string& diagnostic : camera.diagnostics)
    diagnostics += (diagnostics.empty() ? "" : "; ") + diagnostic;
  node_.status.diagnostic("camera " + camera.camera, diagnostics);
  node_.status.latency("read", camera.read_s);
  node_.status.latency("segment", camera.segment_s);
}

}  // namespace fivepipe::capture
