// What a node tells about itself: counts, drops by reason, latencies, diagnostics. Published as
// NodeStatus twice a second by its own thread, so that a long step never looks like a dead process.
// Thread-safe.
#pragma once
#include <cstdint>
#include <memory>
#include <string>

#include "common/pipeline/bus/bus.h"

namespace fivepipe::node {

// Counts named so, with the topic behind it: messages written since the start.
inline constexpr const char* kSentPrefix = "sent: ";

class NodeStatusReporter {
 public:
  NodeStatusReporter(bus::Bus& bus, std::string node);
  ~NodeStatusReporter();  // publishes the final report
  NodeStatusReporter(const NodeStatusReporter&) = delete;
  NodeStatusReporter& operator=(const NodeStatusReporter&) = delete;

  void count(const std::string& name, std::uint64_t n = 1);
  // Counted by reason, and logged at most once a second per reason.
  void drop(const std::string& reason, std::uint64_t n = 1);
  void latency(const std::string& name, double seconds);
  void frame_handled(std::uint64_t frame);
  // A diagnostic stands until it is set to something else; an empty text removes it.
  void diagnostic(const std::string& topic, const std::string& text);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Measures from construction to destruction.
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
