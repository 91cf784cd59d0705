#include "benchmarks/nodes/pipeline_breakdown.h"

#include <algorithm>
#include <cstdint>

#include "common/base/timing.h"

namespace fivepipe::node_bench {
namespace {

std::vector<double>& times_of(std::vector<std::pair<std::string, std::vector<double>>>& stages,
                              const std::string& stage) {
  auto known =
      std::find_if(stages.begin(), stages.end(), [&](const auto& s) { return s.first == stage; });
  if (known == stages.end()) known = stages.insert(stages.end(), {stage, {}});
  return known->second;
}

// Adds consecutive stages: each begins at the end of the previous one, and no duration is negative.
class CriticalPath {
 public:
  CriticalPath(PipelineBreakdown& breakdown, std::int64_t start_ns)
      : breakdown_(breakdown), now_ns_(start_ns) {}
  void until(const std::string& stage, std::int64_t end_ns) {
    const std::int64_t end_or_now_ns = std::max(now_ns_, end_ns);
    times_of(breakdown_.stages, stage).push_back(1e-6 * double(end_or_now_ns - now_ns_));
    now_ns_ = end_or_now_ns;
  }

 private:
  PipelineBreakdown& breakdown_;
  std::int64_t now_ns_;
};

std::int64_t end_of(const replay::FrameAtNode& frame) {
  return frame.steps.empty() ? frame.last_input_ns : frame.steps.back().end_ns;
}

// Adds the stages of one frame in one node: the node is busy with earlier frames, the input is on
// the bus, the input waits, and the node's own steps. Nodes read inputs between frames, so the time
// that an input queues at a busy node does not count as bus time.
void through_node(CriticalPath& path, const replay::FrameAtNode& frame, std::int64_t free_ns,
                  const std::string& name, const std::string& wait) {
  path.until(name + " busy with frames before", std::min(free_ns, frame.last_input_ns));
  path.until("bus to " + name, frame.last_input_ns);
  if (frame.steps.empty()) return;
  path.until(wait, frame.steps.front().start_ns);
  for (const replay::StepTimes& step : frame.steps) path.until(step.step, step.end_ns);
}

}  // namespace

PipelineBreakdown breakdown_of(const std::vector<replay::FrameTimes>& frames,
                               const PipelineNodes& nodes) {
  PipelineBreakdown breakdown;
  std::map<std::string, std::int64_t> free_ns;  // by node: the end of its previous frame
  for (const replay::FrameTimes& frame : frames) {
    const std::string* slowest = nullptr;
    for (const std::string& name : nodes.reconstruction)
      if (const replay::FrameAtNode& here = frame.nodes.at(name);
          !here.steps.empty() && (!slowest || end_of(here) > end_of(frame.nodes.at(*slowest))))
        slowest = &name;
    const replay::FrameAtNode& rendering = frame.nodes.at(nodes.rendering);
    if (slowest && !rendering.steps.empty() && frame.composited_ns > 0) {
      CriticalPath path(breakdown, frame.sent.start_ns);
      path.until("send inputs", frame.sent.end_ns);
      through_node(path, frame.nodes.at(*slowest), free_ns[*slowest], "reconstruction",
                   "waiting for its pose");
      through_node(path, rendering, free_ns[nodes.rendering], "rendering",
                   "waiting for the simulation");
      breakdown.latency.push_back(1e-6 * double(frame.composited_ns - frame.sent.start_ns));
      breakdown.received.push_back(1e-6 *
                                   double(frame.composite_received_ns - frame.sent.start_ns));
      if (!nodes.simulation.empty()) {
        const replay::FrameAtNode& simulation = frame.nodes.at(nodes.simulation);
        breakdown.simulation.push_back(1e-6 *
                                       double(end_of(simulation) - simulation.last_input_ns));
        breakdown.waited_for_state += end_of(simulation) > rendering.last_input_ns;
      }
    }
    for (const auto& [name, here] : frame.nodes) free_ns[name] = end_of(here);
  }
  return breakdown;
}

void PipelineBreakdown::add(const PipelineBreakdown& other) {
  const auto append = [](std::vector<double>& to, const std::vector<double>& times) {
    to.insert(to.end(), times.begin(), times.end());
  };
  for (const auto& [stage, times] : other.stages) append(times_of(stages, stage), times);
  append(latency, other.latency);
  append(received, other.received);
  append(simulation, other.simulation);
  waited_for_state += other.waited_for_state;
}

double PipelineBreakdown::stages_mean_ms() const {
  double sum = 0;
  for (const auto& [name, time_ms] : stages) sum += base::mean(time_ms);
  return sum;
}

double PipelineBreakdown::explained_fraction() const {
  return received.empty() ? 0 : stages_mean_ms() / base::mean(received);
}

}  // namespace fivepipe::node_bench
