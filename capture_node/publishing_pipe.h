// Captures the cameras of this node and publishes their object-pixel maps and colours.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture_node/capture.h"
#include "common/pipeline/node/frame_trace.h"
#include "common/pipeline/node/run_node.h"

namespace fivepipe::capture {

class FramePublisher {
 public:
  // Opens the sources and learns the backgrounds, then publishes the CameraInfo of each camera.
  // Throws SourceError or HardwareMissing like Capture.
  explicit FramePublisher(node::NodeContext& node);

  struct Set {
    std::uint64_t frame = 0;
    std::int64_t stamp_ns = 0;  // of the earliest image
    std::int64_t start_ns = 0;  // CLOCK_REALTIME at the call of capture()
    std::vector<CapturedCamera> cameras;
    node::FrameSteps steps;
    double cpu_before_publish_s = 0;  // of the calling thread
  };
  // stamp_ns: as in Capture::capture(). Returns nullopt if the file or stream of a camera has
  // ended.
  std::optional<Set> capture(std::int64_t frame, std::int64_t stamp_ns);
  // Publishes the colours and the coverage before the maps, so that a reader that has all maps of a
  // frame also has these. The caller publishes the pose before.
  void publish(Set set);

  // Returns true if the file or stream of a camera has ended: no complete set follows.
  bool ended() const { return capture_.ended(); }
  // Returns true if the calls before have published this frame a short time ago. Frame numbers
  // restart with each process, so that others are of an earlier process of this node.
  bool has_published_lately(std::uint64_t frame) const;

 private:
  void report_progress(std::string_view what, double fraction);
  void count_cpu(const std::vector<CapturedCamera>& cameras, double publish_s);
  void report_camera(const CapturedCamera& camera);
  void use_capture_clock(std::vector<CapturedCamera>& cameras, std::int64_t stamp_ns) const;

  node::NodeContext& node_;
  const config::CaptureConfig& config_;
  bus::Writer<bus::topics::CameraInfo> infos_;
  bus::Writer<bus::topics::ObjectColour> colours_;
  std::optional<bus::Writer<bus::topics::ObjectCoverage>> coverages_;  // if config_.coverage
  bus::Writer<bus::topics::ObjectPixelMap> maps_;
  node::FrameTracer traces_;
  std::optional<std::uint64_t> published_;  // newest published frame
  Capture capture_;
};

}  // namespace fivepipe::capture
