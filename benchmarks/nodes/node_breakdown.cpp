#include "benchmarks/nodes/node_breakdown.h"

#include <algorithm>

#include "common/base/timing.h"

namespace fivepipe::node_bench {
namespace {

double ms(std::int64_t ns) { return 1e-6 * double(ns); }

void add_step(NodeBreakdown& breakdown, const std::string& name, double time_ms) {
  const auto known = std::find_if(breakdown.steps.begin(), breakdown.steps.end(),
                                  [&](const auto& step) { return step.first == name; });
  auto& times = known == breakdown.steps.end()
                    ? breakdown.steps.emplace_back(name, std::vector<double>{}).second
                    : known->second;
  times.push_back(time_ms);
}

}  // namespace

NodeBreakdown breakdown_of(const std::vector<replay::FrameTimes>& frames, const std::string& node) {
  NodeBreakdown breakdown;
  std::int64_t end_before_ns = 0;
  for (const replay::FrameTimes& frame : frames) {
    const auto found = frame.nodes.find(node);
    if (found == frame.nodes.end() || found->second.steps.empty())
      continue;  // a frame of which the node makes nothing
    const replay::FrameAtNode& here = found->second;
    const std::int64_t end_ns = here.steps.back().end_ns;
    if (end_before_ns > 0) {
      add_step(breakdown, "decode_inputs",
               ms(here.steps.front().start_ns - std::max(here.last_input_ns, end_before_ns)));
      for (const replay::StepTimes& step : here.steps)
        add_step(breakdown, step.step, ms(step.end_ns - step.start_ns));
      breakdown.own.push_back(ms(end_ns - std::max(here.last_input_ns, end_before_ns)));
      breakdown.period.push_back(ms(end_ns - end_before_ns));
      breakdown.transport.push_back(ms(std::max<std::int64_t>(
          0, here.last_input_ns - std::max(end_before_ns, frame.sent.release_ns))));
      breakdown.latency.push_back(ms(end_ns - frame.sent.start_ns));
    }
    end_before_ns = end_ns;
  }
  return breakdown;
}

double NodeBreakdown::own_fraction() const {
  return period.empty() ? 0 : base::mean(own) / base::mean(period);
}
double NodeBreakdown::explained_fraction() const {
  return period.empty() ? 0 : (base::mean(own) + base::mean(transport)) / base::mean(period);
}

}  // namespace fivepipe::node_bench
