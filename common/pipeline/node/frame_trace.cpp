#include "common/pipeline/node/frame_trace.h"

#include "common/base/realtime.h"
#include "common/pipeline/messages/wire_conversions.h"

namespace fivepipe::node {

void FrameSteps::begin(std::string step) {
  const std::int64_t now_ns = base::now_realtime_ns();
  if (open_) steps_.back().end_ns = now_ns;
  steps_.push_back({std::move(step), now_ns, now_ns});
  open_ = true;
}

void FrameSteps::end() {
  if (open_) steps_.back().end_ns = base::now_realtime_ns();
  open_ = false;
}

FrameTracer::FrameTracer(bus::Bus& bus, NodeStatusReporter& status, std::string node)
    : status_(status), node_(std::move(node)), traces_(bus.writer<bus::topics::FrameTrace>()) {}

void FrameTracer::handled(std::uint64_t frame, std::int64_t capture_stamp_ns,
                          const InputTimes& inputs, FrameSteps steps) {
  steps.end();
  for (const FrameSteps::Step& step : steps.steps())
    status_.latency(step.name, 1e-9 * double(step.end_ns - step.start_ns));
  status_.frame_handled(frame);
  if (traces_.readers() == 0) return;
  std::vector<fivepipe_v1_FrameStep> wire_steps(steps.steps().size());
  for (std::size_t i = 0; i < wire_steps.size(); ++i) {
    messages::set_text(wire_steps[i].step, steps.steps()[i].name);
    wire_steps[i].start_ns = steps.steps()[i].start_ns;
    wire_steps[i].end_ns = steps.steps()[i].end_ns;
  }
  fivepipe_v1_FrameTrace message{};
  messages::set_text(message.node, node_);
  message.frame = frame;
  message.capture_stamp_ns = capture_stamp_ns;
  message.first_input_ns = inputs.first_ns;
  message.last_input_ns = inputs.last_ns;
  messages::borrow(message.steps, wire_steps);
  traces_.write(message);
}

}  // namespace fivepipe::node
