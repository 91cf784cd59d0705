#include "benchmarks/nodes/node_breakdown.h"

#include <algorithm>

#include "common/base/timing.h"

namespace fivepipe::node_bench {
namespace {

double ms(std::int64_t ns) { return 1e-6 * double(ns); }

std::vector<double>& times_of(NodeBreakdown& breakdown, const std::string& step) {
  for (auto& [name, time_ms] : breakdown.steps)
    if (name == step) return time_ms;
  return breakdown.steps.emplace_back(step, std::vector<double>{}).second;
}

void append(std::vector<double>& to, const std::vector<double>& time_ms) {
  to.insert(to.end(), time_ms.begin(), time_ms.end());
}

}  // namespace

NodeBreakdown breakdown_of(const std::vector<replay::FrameTimes>& frames, const std::string& node) {
  NodeBreakdown breakdown;
  std::int64_t end_before_ns = 0;
  for (const replay::FrameTimes& frame : frames) {
    const auto found = frame.nodes.find(node);
    if (found == frame.nodes.end() || found->second.steps.empty()) continue;
    const replay::FrameAtNode& here = found->second;
    const std::int64_t end_ns = here.steps.back().end_ns;
    if (end_before_ns > 0) {
      times_of(breakdown, "decode_inputs")
          .push_back(ms(here.steps.front().start_ns - std::max(here.last_input_ns, end_before_ns)));
      for (const replay::StepTimes& step : here.steps)
        times_of(breakdown, step.step).push_back(ms(step.end_ns - step.start_ns));
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

void NodeBreakdown::add(const NodeBreakdown& other) {
  for (const auto& [step, time_ms] : other.steps) append(times_of(*this, step), time_ms);
  append(own, other.own);
  append(period, other.period);
  append(transport, other.transport);
  append(latency, other.latency);
}

}  // namespace fivepipe::node_bench
