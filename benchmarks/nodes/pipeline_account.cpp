#include "benchmarks/nodes/pipeline_account.h"

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

// Consecutive times: each stage begins where the one before ends, and none is negative.
class Way {
 public:
  Way(PipelineAccount& account, std::int64_t start_ns) : account_(account), now_ns_(start_ns) {}
  void until(const std::string& stage, std::int64_t end_ns) {
    const std::int64_t end_or_now_ns = std::max(now_ns_, end_ns);
    times_of(account_.stages, stage).push_back(1e-6 * double(end_or_now_ns - now_ns_));
    now_ns_ = end_or_now_ns;
  }

 private:
  PipelineAccount& account_;
  std::int64_t now_ns_;
};

std::int64_t end_of(const replay::FrameAtNode& frame) {
  return frame.steps.empty() ? frame.last_input_ns : frame.steps.back().end_ns;
}

// The node's way of one frame: busy with frames before, on the bus, in its queue, its own steps.
// Nodes take inputs between frames: what lay there while it was busy is not the bus's time.
void through_node(Way& way, const replay::FrameAtNode& frame, std::int64_t free_ns,
                  const std::string& name, const std::string& wait) {
  way.until(name + " busy with frames before", std::min(free_ns, frame.last_input_ns));
  way.until("bus to " + name, frame.last_input_ns);
  if (frame.steps.empty()) return;
  way.until(wait, frame.steps.front().start_ns);
  for (const replay::StepTimes& step : frame.steps) way.until(step.step, step.end_ns);
}

}  // namespace

PipelineAccount account_of(const std::vector<replay::FrameTimes>& frames,
                           const PipelineNodes& nodes) {
  PipelineAccount account;
  std::map<std::string, std::int64_t> free_ns;  // by node: done with the frame before
  for (const replay::FrameTimes& frame : frames) {
    const std::string* slowest = nullptr;
    for (const std::string& name : nodes.reconstruction)
      if (const replay::FrameAtNode& here = frame.nodes.at(name);
          !here.steps.empty() && (!slowest || end_of(here) > end_of(frame.nodes.at(*slowest))))
        slowest = &name;
    const replay::FrameAtNode& rendering = frame.nodes.at(nodes.rendering);
    if (slowest && !rendering.steps.empty() && frame.composited_ns > 0) {
      Way way(account, frame.sent.start_ns);
      way.until("send inputs", frame.sent.end_ns);
      through_node(way, frame.nodes.at(*slowest), free_ns[*slowest], "reconstruction",
                   "waiting for its pose");
      through_node(way, rendering, free_ns[nodes.rendering], "rendering",
                   "waiting for the simulation");
      account.latency.push_back(1e-6 * double(frame.composited_ns - frame.sent.start_ns));
      account.heard.push_back(1e-6 * double(frame.composite_heard_ns - frame.sent.start_ns));
      if (!nodes.simulation.empty()) {
        const replay::FrameAtNode& simulation = frame.nodes.at(nodes.simulation);
        account.simulation.push_back(1e-6 * double(end_of(simulation) - simulation.last_input_ns));
        account.waited_for_state += end_of(simulation) > rendering.last_input_ns;
      }
    }
    for (const auto& [name, here] : frame.nodes) free_ns[name] = end_of(here);
  }
  return account;
}

void PipelineAccount::add(const PipelineAccount& other) {
  const auto append = [](std::vector<double>& to, const std::vector<double>& times) {
    to.insert(to.end(), times.begin(), times.end());
  };
  for (const auto& [stage, times] : other.stages) append(times_of(stages, stage), times);
  append(latency, other.latency);
  append(heard, other.heard);
  append(simulation, other.simulation);
  waited_for_state += other.waited_for_state;
}

double PipelineAccount::stages_mean_ms() const {
  double sum = 0;
  for (const auto& [name, time_ms] : stages) sum += base::mean(time_ms);
  return sum;
}

double PipelineAccount::explained_share() const {
  return heard.empty() ? 0 : stages_mean_ms() / base::mean(heard);
}

}  // namespace fivepipe::node_bench
