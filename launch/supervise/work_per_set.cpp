#include "launch/supervise/work_per_set.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "common/pipeline/node/status_names.h"

namespace fivepipe::launch {
namespace {

// The requested rate counts as reached from this fraction on, because a run ends between frames.
constexpr double kReached = 0.97;
// From this fraction of the cores' time on, the processor limits the rate.
constexpr double kBusy = 0.85;

using Counts = std::map<std::string, std::uint64_t>;

// Sums over the processes of all programs of this kind.
Counts counts_of(const ReportInput& input, const char* program) {
  Counts sums;
  const auto processes = input.statuses.processes();
  for (const ProgramHistory& history : input.programs) {
    if (history.program != program) continue;
    const auto node = processes.find(history.name);
    if (node == processes.end()) continue;
    for (const ProcessStatus& process : node->second)
      for (const auto& [name, count] : process.counts) sums[name] += count;
  }
  return sums;
}

// The node that keeps most cores busy: a node with one busy thread uses one core.
struct Busiest {
  std::string node;
  double cores = 0;
};
Busiest busiest_of(const ReportInput& input, std::uint64_t composited, double rate_hz) {
  Busiest busiest;
  const auto processes = input.statuses.processes();
  for (const ProgramHistory& history : input.programs) {
    const auto node = processes.find(history.name);
    if (node == processes.end()) continue;
    std::uint64_t us = 0;
    for (const ProcessStatus& process : node->second)
      if (const auto count = process.counts.find(node::kFramesCpu); count != process.counts.end())
        us += count->second;
    const double cores = 1e-6 * double(us) / double(composited - 1) * rate_hz;
    if (cores > busiest.cores) busiest = {history.name, cores};
  }
  return busiest;
}

}  // namespace

nlohmann::json core_ms_per_set(const ReportInput& input, std::uint64_t composited) {
  if (composited < kMinSets) return nullptr;
  Counts capture = counts_of(input, "capture_node");
  const std::uint64_t segmentation = capture[node::kSegmentationCpu],
                      publishing = capture[node::kPublishingCpu],
                      all = std::max(capture[node::kFramesCpu], segmentation + publishing);
  const std::array<std::pair<const char*, std::uint64_t>, 6> parts{
      {{"decoding", all - segmentation - publishing},
       {"segmentation", segmentation},
       {"publishing", publishing},
       {"hull", counts_of(input, "recon_node")[node::kFramesCpu]},
       {"simulation", counts_of(input, "sim_node")[node::kFramesCpu]},
       {"drawing", counts_of(input, "render_node")[node::kFramesCpu]}}};
  nlohmann::json result = nlohmann::json::object();
  double sum_ms = 0;
  for (const auto& [part, us] : parts) {
    // The work on the first set is before the first count.
    const double ms = 1e-3 * double(us) / double(composited - 1);
    result[part] = ms;
    sum_ms += ms;
  }
  result["sum"] = sum_ms;
  return result;
}

std::string what_bounds_the_rate(const ReportInput& input, const nlohmann::json& core_ms_per_set,
                                 std::uint64_t composited, double frame_rate_hz) {
  // The nodes of other hosts have no process here.
  const bool is_one_host = std::all_of(input.programs.begin(), input.programs.end(),
                                       [](const auto& node) { return !node.processes.empty(); });
  if (core_ms_per_set.is_null() || input.cores <= 0 || !is_one_host) return "";
  if (input.requested_rate_hz && frame_rate_hz >= kReached * *input.requested_rate_hz)
    return fmt::format("the requested rate of {:g} Hz", *input.requested_rate_hz);
  const double sum_ms = core_ms_per_set["sum"],
               busy = 1e-3 * sum_ms * frame_rate_hz / double(input.cores);
  std::string largest;
  for (const auto& [part, ms] : core_ms_per_set.items())
    if (part != "sum" && (largest.empty() || ms > core_ms_per_set[largest])) largest = part;
  const std::string of_largest = fmt::format("{} takes {:.1f} of {:.1f} core-ms per set", largest,
                                             core_ms_per_set[largest].get<double>(), sum_ms);
  if (busy >= kBusy) return "the processor: " + of_largest;
  const Busiest busiest = busiest_of(input, composited, frame_rate_hz);
  return fmt::format(
      "waiting: the nodes use {:.0f} % of the {} cores, {} most with {:.2f} cores; {}", 100 * busy,
      input.cores, busiest.node, busiest.cores, of_largest);
}

}  // namespace fivepipe::launch
