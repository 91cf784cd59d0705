// What a benchmark observes while nodes run: the times of each frame, the nodes' status, and the
// messages on the loopback interface.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "benchmarks/nodes/wire/bus_trace.h"
#include "common/pipeline/bus/bus.h"
#include "common/recording/replay/frame_times.h"
#include "launch/supervise/status/node_status.h"

namespace fivepipe::node_bench {

struct RunObservations {
  std::vector<replay::FrameTimes> frames;  // that every node handled, in order
  // If the bus was traced: the messages of each frame, or why there are none.
  std::map<std::uint64_t, wire::FrameMessages> messages;
  std::string no_messages;
  std::map<std::string, std::map<std::string, std::uint64_t>> drops;  // by node and reason
  std::string gl_renderer;  // as the nodes report it; empty if none uses OpenGL
};

class RunObserver {
 public:
  // `nodes` are the observed nodes. `bus` must outlive this object.
  RunObserver(bus::Bus& bus, std::uint32_t domain, std::set<std::string> nodes);
  ~RunObserver();

  void listen_to_composites();
  void trace_bus();  // follows the writers that discovery has found
  void sent(std::uint64_t frame, const replay::SendTimes& sent);
  void handled(const fivepipe_v1_FrameTrace& trace);
  void take_statuses();
  // Call after the nodes have ended. Frames that were not sent (`sent_only`) are omitted.
  RunObservations end(bool sent_only);

 private:
  class CompositeListener;
  const std::uint32_t domain_;
  bus::Bus& bus_;
  const std::set<std::string> nodes_;
  bus::Reader<bus::topics::NodeStatus> statuses_in_;
  launch::StatusRegistry statuses_;
  std::unique_ptr<CompositeListener> composites_;
  std::unique_ptr<wire::BusTrace> trace_;
  std::string no_trace_;
  std::map<std::uint64_t, replay::FrameTimes> frames_;
};

}  // namespace fivepipe::node_bench
