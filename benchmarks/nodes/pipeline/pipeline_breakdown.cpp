#include "benchmarks/nodes/pipeline/pipeline_breakdown.h"

#include <algorithm>
#include <cstdint>

#include "common/base/timing.h"

namespace fivepipe::node_bench {
namespace {

double ms(std::int64_t ns) { return 1e-6 * double(ns); }

std::vector<double>& times_of(std::vector<std::pair<std::string, std::vector<double>>>& stages,
                              const std::string& stage) {
  auto known =
      std::find_if(stages.begin(), stages.end(), [&](const auto& s) { return s.first == stage; });
  if (known == stages.end()) known = stages.insert(stages.end(), {stage, {}});
  return known->second;
}

// Consecutive stages: each begins at the end of the previous one, and no duration is negative.
class CriticalPath {
 public:
  explicit CriticalPath(std::int64_t start_ns) : now_ns_(start_ns) {}
  void until(const std::string& stage, std::int64_t end_ns) {
    const std::int64_t end_or_now_ns = std::max(now_ns_, end_ns);
    const double time_ms = ms(end_or_now_ns - now_ns_);
    now_ns_ = end_or_now_ns;
    for (auto& [known, known_ms] : stages_)
      if (known == stage) {
        known_ms += time_ms;
        return;
      }
    stages_.emplace_back(stage, time_ms);
  }
  const FrameStages& stages() const { return stages_; }

 private:
  FrameStages stages_;
  std::int64_t now_ns_;
};

std::int64_t end_of(const replay::FrameAtNode& frame) {
  return frame.steps.empty() ? frame.last_input_ns : frame.steps.back().end_ns;
}

// The node is busy with earlier frames, then its last input is on the bus. Nodes read inputs
// between frames, so the time that an input queues at a busy node does not count as bus time. A
// node that takes the inputs of two frames at once is still busy with the first one afterwards.
void to_node(CriticalPath& path, const replay::FrameAtNode& frame, std::int64_t free_ns,
             const char* busy, const char* bus) {
  path.until(busy, std::min(free_ns, frame.last_input_ns));
  path.until(bus, frame.last_input_ns);
  path.until(busy, std::min(free_ns, frame.steps.front().start_ns));
}
// The next node on the path may have its last input before the writer's call returns, because the
// kernel may run the reader first. The path then leaves the writer at that time.
void through_steps(CriticalPath& path, const replay::FrameAtNode& frame,
                   std::int64_t next_has_inputs_ns = INT64_MAX) {
  for (const replay::StepTimes& step : frame.steps)
    path.until(step.step, std::min(step.end_ns, next_has_inputs_ns));
}

struct PathNodes {
  const replay::FrameAtNode *reconstruction, *rendering;
  std::int64_t reconstruction_free_ns, rendering_free_ns;
  std::int64_t simulated_ns;  // the simulation's state was written; 0: no simulation
};

FrameStages stages_of(const replay::FrameTimes& frame, const PathNodes& at,
                      const replay::FrameAtNode* capture, std::int64_t start_ns) {
  CriticalPath path(start_ns);
  const std::int64_t has_maps_ns = at.reconstruction->last_input_ns;
  if (capture)
    through_steps(path, *capture, has_maps_ns);
  else
    path.until(stage::kSend, std::min(frame.sent.end_ns, has_maps_ns));
  to_node(path, *at.reconstruction, at.reconstruction_free_ns, stage::kReconBusy, stage::kReconBus);
  path.until(stage::kReconInputs, at.reconstruction->steps.front().start_ns);
  through_steps(path, *at.reconstruction, at.rendering->last_input_ns);
  to_node(path, *at.rendering, at.rendering_free_ns, stage::kRenderBusy, stage::kRenderBus);
  const std::int64_t render_ns = at.rendering->steps.front().start_ns;
  path.until(stage::kSimulation, std::min(render_ns, at.simulated_ns));
  path.until(stage::kRenderInputs, render_ns);
  through_steps(path, *at.rendering);
  return path.stages();
}

// Returns the node whose tiles were written last; empty if none has tiles of the frame.
std::string slowest_of(const replay::FrameTimes& frame, const PipelineNodes& nodes) {
  std::string slowest;
  for (const std::string& name : nodes.reconstruction)
    if (const replay::FrameAtNode& here = frame.nodes.at(name);
        !here.steps.empty() && (slowest.empty() || end_of(here) > end_of(frame.nodes.at(slowest))))
      slowest = name;
  return slowest;
}

void append(std::vector<double>& to, const std::vector<double>& times) {
  to.insert(to.end(), times.begin(), times.end());
}

}  // namespace

PipelineBreakdown breakdown_of(const std::vector<replay::FrameTimes>& frames,
                               const PipelineNodes& nodes) {
  PipelineBreakdown breakdown;
  std::map<std::string, std::int64_t> free_ns;  // by node: the end of its previous frame
  for (const replay::FrameTimes& frame : frames) {
    const std::string slowest = slowest_of(frame, nodes);
    const replay::FrameAtNode& rendering = frame.nodes.at(nodes.rendering);
    const replay::FrameAtNode* simulation =
        nodes.simulation.empty() ? nullptr : &frame.nodes.at(nodes.simulation);
    const replay::FrameAtNode* capture =
        nodes.capture.empty() ? nullptr : &frame.nodes.at(nodes.capture);
    const bool captured = !capture || !capture->steps.empty();
    if (!slowest.empty() && !rendering.steps.empty() && frame.composited_ns > 0 && captured) {
      const std::int64_t start_ns = capture ? capture->steps.front().start_ns : frame.sent.start_ns;
      const FrameStages stages =
          stages_of(frame,
                    {&frame.nodes.at(slowest), &rendering, free_ns[slowest],
                     free_ns[nodes.rendering], simulation ? end_of(*simulation) : 0},
                    capture, start_ns);
      for (const auto& [name, time_ms] : stages)
        times_of(breakdown.stages, name).push_back(time_ms);
      breakdown.by_frame[frame.frame] = stages;
      breakdown.latency.push_back(ms(frame.composited_ns - start_ns));
      breakdown.received.push_back(ms(frame.composite_received_ns - start_ns));
      if (simulation) {
        breakdown.simulation.push_back(ms(end_of(*simulation) - simulation->last_input_ns));
        breakdown.waited_for_state += end_of(*simulation) > rendering.last_input_ns;
      }
    }
    for (const auto& [name, here] : frame.nodes) free_ns[name] = end_of(here);
  }
  return breakdown;
}

void PipelineBreakdown::add(const PipelineBreakdown& other) {
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
