#include "benchmarks/nodes/run_observer.h"

#include <chrono>
#include <system_error>
#include <thread>

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"
#include "launch/supervise/status/status_messages.h"

namespace fivepipe::node_bench {

using namespace std::chrono_literals;

// Receives FrameComposited in its own thread, because the benchmark may be busy sending when one
// arrives.
class RunObserver::CompositeListener {
 public:
  struct ReceivedComposite {
    std::int64_t composited_ns = 0, received_ns = 0;
  };
  explicit CompositeListener(std::uint32_t domain)
      : bus_({.domain = domain, .participant = "bench_composites"}),
        composited_(bus_.reader<bus::topics::FrameComposited>()),
        thread_([this](std::stop_token stop) {
          for (bool last = false; !last; take()) {
            last = stop.stop_requested();
            bus_.wait(last ? 0ms : 20ms);
          }
        }) {}
  // Stops the thread and returns the composites by frame.
  const std::map<std::uint64_t, ReceivedComposite>& end() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    return received_;
  }

 private:
  void take() {
    for (const auto& sample : composited_.take())
      if (sample.valid() && !messages::why_implausible(sample->frame, sample->composited_stamp_ns))
        received_[sample->frame] = {sample->composited_stamp_ns, base::now_realtime_ns()};
  }

  bus::Bus bus_;
  bus::Reader<bus::topics::FrameComposited> composited_;
  // Only the thread accesses it until it ends.
  std::map<std::uint64_t, ReceivedComposite> received_;
  std::jthread thread_;
};

RunObserver::RunObserver(bus::Bus& bus, std::uint32_t domain, std::set<std::string> nodes)
    : domain_(domain),
      bus_(bus),
      nodes_(std::move(nodes)),
      statuses_in_(bus.reader<bus::topics::NodeStatus>()) {}
RunObserver::~RunObserver() = default;

void RunObserver::listen_to_composites() {
  composites_ = std::make_unique<CompositeListener>(domain_);
}

void RunObserver::trace_bus() {
  try {
    trace_ = std::make_unique<wire::BusTrace>(bus_);
  } catch (const std::system_error& error) {
    no_trace_ = std::string("cannot trace the loopback interface, which needs CAP_NET_RAW: ") +
                error.what();
  }
}

void RunObserver::sent(std::uint64_t frame, const replay::SendTimes& sent) {
  frames_[frame].sent = sent;
}

void RunObserver::handled(const fivepipe_v1_FrameTrace& trace) {
  if (!nodes_.contains(trace.node)) return;
  replay::FrameAtNode& frame = frames_[trace.frame].nodes[trace.node];
  frame = {trace.first_input_ns, trace.last_input_ns, {}};
  for (std::uint32_t i = 0; i < trace.steps._length; ++i) {
    const fivepipe_v1_FrameStep& step = trace.steps._buffer[i];
    frame.steps.push_back({step.step, step.start_ns, step.end_ns});
  }
}

void RunObserver::take_statuses() { launch::take_statuses(statuses_in_, statuses_, nodes_); }

RunObservations RunObserver::end(bool sent_only) {
  take_statuses();
  RunObservations observed;
  observed.no_messages = no_trace_;
  if (trace_) observed.messages = trace_->end();
  if (composites_)
    for (const auto& [frame, received] : composites_->end()) {
      frames_[frame].composited_ns = received.composited_ns;
      frames_[frame].composite_received_ns = received.received_ns;
    }
  for (const auto& [name, processes] : statuses_.processes()) {
    observed.drops[name] = processes.back().drops;
    if (!processes.back().gl_renderer.empty()) observed.gl_renderer = processes.back().gl_renderer;
  }
  for (auto& [number, frame] : frames_) {
    frame.frame = number;
    if ((!sent_only || frame.sent.start_ns > 0) && frame.nodes.size() == nodes_.size())
      observed.frames.push_back(std::move(frame));
  }
  return observed;
}

}  // namespace fivepipe::node_bench
