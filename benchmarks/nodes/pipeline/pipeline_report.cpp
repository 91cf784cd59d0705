#include "benchmarks/nodes/pipeline/pipeline_report.h"

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "benchmarks/nodes/from_recording.h"
#include "benchmarks/nodes/times_table.h"
#include "common/base/timing.h"

namespace fivepipe::node_bench {

using nlohmann::ordered_json;

void PipelineResult::add(const PipelineResult& other) {
  breakdown.add(other.breakdown);
  append(agreement, other.agreement);
  frames += other.frames;
  seconds += other.seconds;
  replay_cpu_s += other.replay_cpu_s;
  gl_renderer = other.gl_renderer;
}

void print_stages(const PipelineResult& result) {
  const PipelineBreakdown& breakdown = result.breakdown;
  std::cout << fmt::format("{} frames, {:.1f} frames/s\n", breakdown.latency.size(),
                           double(result.frames) / result.seconds);
  base::TextTable table = times_table();
  for (const auto& [stage, time_ms] : breakdown.stages) add_times(table, stage, time_ms);
  table.add({"all stages", base::with_decimals(breakdown.stages_mean_ms(), 3), "", "", ""});
  add_times(table, "from the first stage to the composite", breakdown.latency);
  add_times(table, "until FrameComposited arrived here", breakdown.received);
  std::cout << table.text()
            << fmt::format(
                   "the stages explain {:.1f} % of the time until FrameComposited arrived\n",
                   100 * breakdown.explained_fraction());
  if (!breakdown.simulation.empty())
    std::cout << fmt::format(
        "in parallel, the simulation: {:.2f} ms; the renderer waited for it in {} of {} frames\n",
        base::mean(breakdown.simulation), breakdown.waited_for_state, breakdown.latency.size());
}

void print_agreement(const std::vector<StageAgreement>& stages, const std::string& no_messages) {
  if (stages.empty()) {
    std::cout << "the stages are not checked from outside the nodes: "
              << (no_messages.empty() ? "no frame has all messages" : no_messages) << '\n';
    return;
  }
  base::TextTable table({{"ms, means", false, 0, 40},
                         {"frames", true},
                         {"by the nodes", true},
                         {"outside", true},
                         {"difference", true},
                         {"p5", true},
                         {"p95", true},
                         {"limit", true},
                         {"of p5, p95", true},
                         {""}});
  bool agree = true;
  for (const StageAgreement& stage : stages) {
    agree &= stage.agrees();
    const StageAgreement::Means means = stage.means_ms();
    table.add({stage.stage, std::to_string(stage.own_ms.size()),
               base::with_decimals(means.own_ms, 3), base::with_decimals(means.outside_ms, 3),
               base::with_decimals(means.outside_ms - means.own_ms, 3),
               base::with_decimals(stage.difference_ms(kTail), 3),
               base::with_decimals(stage.difference_ms(1 - kTail), 3),
               base::with_decimals(stage.limit_ms(), 3),
               base::with_decimals(stage.tail_limit_ms(), 3), stage.agrees() ? "" : "DIFFERS"});
  }
  std::cout << "checked from outside the nodes, by their messages on the loopback interface:\n"
            << table.text()
            << fmt::format(
                   "{} within {:g} % or {:g} ms, whichever is larger; the means are without the "
                   "{:g} % of the frames with the largest and with the smallest difference. p5 and "
                   "p95 of the difference are of all frames, within {:g} % or {:g} ms\n",
                   agree ? "all stages agree" : "NOT all stages agree",
                   100 * kMaxDifferenceFraction, kMaxDifference_ms, 100 * kOmittedFraction,
                   100 * kMaxDifferenceFraction, kMaxTail_ms);
}

void print_resources(const PipelineResult& result, const std::map<std::string, ProcessUse>& use,
                     const RunObservations& observed) {
  base::TextTable table({{"node"}, {"CPU %", true}, {"peak MB", true}});
  for (const auto& [node, used] : use)
    table.add({node, base::with_decimals(100 * used.cpu_s / result.seconds, 0),
               base::with_decimals(used.peak_memory_mb, 0)});
  if (result.replay_cpu_s > 0)
    table.add({"(the replay itself)",
               base::with_decimals(100 * result.replay_cpu_s / result.seconds, 0), ""});
  std::cout << table.text();
  for (const auto& [node, drops] : observed.drops)
    for (const auto& [reason, count] : drops)
      std::cout << fmt::format("{} dropped {}: {}\n", node, count, reason);
  std::cout << std::flush;
}

void print_bus(const std::vector<BusTimes>& bus) {
  base::TextTable table({{"bytes", true},
                         {"fivepipe", true},
                         {"ddsperf, waitset", true},
                         {"ddsperf, listener", true}});
  for (const BusTimes& times : bus) {
    const double ours_us = base::percentile(times.ours_us, 0.5);
    const auto relative = [&](const std::vector<double>& times_us) {
      const double us = base::percentile(times_us, 0.5);
      return fmt::format("{:.1f} ({:.2f}x)", us, ours_us / us);
    };
    table.add({std::to_string(times.size_bytes), base::with_decimals(ours_us, 1),
               relative(times.ddsperf_us), relative(times.ddsperf_listener_us)});
  }
  std::cout << "the bus alone: half a round trip, medians in us (fivepipe's time relative to "
               "ddsperf's)\n"
            << table.text() << std::flush;
}

ordered_json results_json(const PipelineResult& result, const std::string& prefix,
                          const ordered_json& counts) {
  const PipelineBreakdown& all = result.breakdown;
  ordered_json entries = ordered_json::array();
  for (const auto& [stage, time_ms] : all.stages)
    entries.push_back(result_json(prefix + stage, time_ms));
  ordered_json latency_counts = {{"frames", result.frames},
                                 {"frames_per_s", double(result.frames) / result.seconds},
                                 {"stages_mean_ms", all.stages_mean_ms()},
                                 {"heard_mean_ms", base::mean(all.received)},
                                 {"explained_share", all.explained_fraction()}};
  latency_counts.update(counts);
  entries.push_back(result_json(prefix + "latency", all.latency, latency_counts));
  for (const StageAgreement& stage : result.agreement)
    entries.push_back(result_json(prefix + "outside/" + stage.stage, stage.outside_ms,
                                  {{"frames", stage.outside_ms.size()},
                                   {"nodes_mean_ms", stage.means_ms().own_ms},
                                   {"outside_mean_ms", stage.means_ms().outside_ms},
                                   {"difference_p5_ms", stage.difference_ms(kTail)},
                                   {"difference_p95_ms", stage.difference_ms(1 - kTail)},
                                   {"limit_ms", stage.limit_ms()},
                                   {"tail_limit_ms", stage.tail_limit_ms()},
                                   {"agrees", stage.agrees()}}));
  return entries;
}

ordered_json bus_json(const std::vector<BusTimes>& bus) {
  ordered_json entries = ordered_json::array();
  for (const BusTimes& times : bus) {
    std::vector<double> ours_ms;
    for (const double us : times.ours_us) ours_ms.push_back(1e-3 * us);
    entries.push_back(result_json(
        fmt::format("bus/{}_bytes", times.size_bytes), ours_ms,
        {{"ddsperf_waitset_median_us", base::percentile(times.ddsperf_us, 0.5)},
         {"ddsperf_listener_median_us", base::percentile(times.ddsperf_listener_us, 0.5)}}));
  }
  return entries;
}

}  // namespace fivepipe::node_bench
