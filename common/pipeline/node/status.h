// Collects a node's counts, drops, latencies and diagnostics and publishes them as NodeStatus.
// A thread of its own publishes twice per second, so that a node in a long step still reports, and
// a new diagnostic within 0.1 s.
#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/hull/hull.h"
#include "common/pipeline/bus/bus.h"
#include "common/pipeline/messages/bad_message.h"
#include "common/pipeline/node/capture_clock.h"

namespace fivepipe::node {

// Counts of a recorder's messages of one topic since its start.
struct RecordedCounts {
  std::uint64_t received = 0;
  std::uint64_t recorded = 0;  // in the file
  std::uint64_t lost = 0;      // received and not recorded: the disk was too slow or full
};

// Thread-safe. All counts are totals since the construction. Texts that exceed their field in
// NodeStatus are truncated.
class NodeStatusReporter {
 public:
  // clock: as capture_clock_of() returns it; this updates it.
  NodeStatusReporter(bus::Bus& bus, std::string node, CaptureClock* clock = nullptr);
  ~NodeStatusReporter();  // publishes the final report
  NodeStatusReporter(const NodeStatusReporter&) = delete;
  NodeStatusReporter& operator=(const NodeStatusReporter&) = delete;

  // So long after the first latency without a compared clock, a diagnostic reports it.
  static constexpr std::chrono::seconds kComparisonPatience{5};

  // Adds n to the count of this name.
  void count(const std::string& name, std::uint64_t n = 1);
  // Counts n dropped messages; beyond the limits of DropCounts without their subject. Logs each
  // distinct drop at most once per second, and all together within a LogBudget, without control
  // characters. n = 0: no effect.
  void drop(const messages::BadMessage& bad, std::uint64_t n = 1);
  void drop(const std::string& reason, std::uint64_t n = 1) {
    drop(messages::BadMessage{reason, {}, {}}, n);
  }
  // Counts a dropped message, and its sender as refuse() does.
  void drop_from(const std::optional<bus::ProcessId>& sender, const messages::BadMessage& bad);
  // Counts n invalid messages of a process (status_names.h: kRefusedFrom).
  void refuse(const std::optional<bus::ProcessId>& sender, std::uint64_t n);
  // Adds one value to the latency of this name.
  void latency(const std::string& name, double seconds);
  // Adds the time from the capture, by the clock of the host that captures, until now_ns, by the
  // clock of this host. If the clocks are not compared, adds it to `name` with kNotCompared.
  void latency_since_capture(const std::string& name, std::int64_t capture_stamp_ns,
                             std::int64_t now_ns);
  // Call once per frame; the status reports the newest frame and the rate.
  void frame_handled(std::uint64_t frame);

  // Counts a frame set in which the camera had no object pixel, so that the hull was empty.
  void empty_camera(const std::string& camera);
  // Counts a frame in which the object collided, with that many collision points.
  void collided(const std::string& object, std::uint64_t points);
  void first_contact(const std::string& object);
  // Replaces the counts of this topic.
  void recorded(const std::string& topic, const RecordedCounts& totals);

  // GL_RENDERER and version of the context that the node draws or computes with.
  void set_gl_renderer(const std::string& renderer);
  // Sets the diagnostic for this subject until the next call for it. An empty text removes it. The
  // subjects must be bounded: names of the configuration, not of messages.
  void diagnostic(const std::string& subject, const std::string& text);
  // Sets the diagnostic about the preparation before the first frame. An empty text removes it.
  // Logs each text without a limit: no message causes it.
  void start_progress(const std::string& text);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Returns the diagnostic for a hull that is empty because these cameras have no object pixel, or an
// empty text if it is not: with Limits::all one such camera suffices; with Limits::seen fewer than
// min_seen other cameras must remain. shape_cameras: number of all cameras that give shape.
std::string empty_hull_text(const std::vector<std::string>& cameras, const hull::HullRule& rule,
                            std::size_t shape_cameras);

// Reports the time from its construction to its destruction as a latency.
class StageTimer {
 public:
  StageTimer(NodeStatusReporter& status, const char* name) : status_(status), name_(name) {}
  ~StageTimer() {
    status_.latency(
        name_, std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count());
  }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  NodeStatusReporter& status_;
  const char* name_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace fivepipe::node
