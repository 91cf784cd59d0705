#include "benchmarks/nodes/pipeline_benchmark.h"

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "benchmarks/nodes/bus_ping.h"
#include "benchmarks/nodes/pipeline_breakdown.h"
#include "benchmarks/nodes/times_table.h"
#include "common/base/result_file.h"
#include "common/base/timing.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::node_bench {
namespace {

using nlohmann::ordered_json;

PipelineNodes nodes_of(const config::Deployment& deployment) {
  PipelineNodes nodes;
  for (const config::Node& node : deployment.nodes) {
    const std::string program = config::program_of(node);
    if (program == "recon_node") nodes.reconstruction.push_back(node.name);
    if (program == "sim_node" && nodes.simulation.empty()) nodes.simulation = node.name;
    if (program == "render_node" && nodes.rendering.empty()) nodes.rendering = node.name;
  }
  if (nodes.reconstruction.empty() || nodes.rendering.empty())
    throw recording::RecordingError(
        fmt::format("deployment {} needs a recon_node and a render_node", deployment.name));
  return nodes;
}

void print_stages(const NodeRun& run, const PipelineBreakdown& breakdown,
                  const PipelineNodes& nodes) {
  std::cout << fmt::format("{} frames, {:.1f} frames/s\n", run.frames.size(),
                           double(run.counts.handled.at(nodes.rendering)) / run.counts.seconds);
  base::TextTable table = times_table();
  for (const auto& [stage, time_ms] : breakdown.stages) add_times(table, stage, time_ms);
  table.add({"all stages", base::with_decimals(breakdown.stages_mean_ms(), 3), "", "", ""});
  add_times(table, "from the first input to the composite", breakdown.latency);
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

void print_resources(const NodeRun& run) {
  base::TextTable table({{"node"}, {"CPU %", true}, {"peak MB", true}});
  for (const auto& [node, use] : run.use)
    table.add({node, base::with_decimals(100 * use.cpu_s / run.counts.seconds, 0),
               base::with_decimals(use.peak_memory_mb, 0)});
  table.add({"(the replay itself)",
             base::with_decimals(100 * run.replay_cpu_s / run.counts.seconds, 0), ""});
  std::cout << table.text();
  for (const auto& [node, drops] : run.drops)
    for (const auto& [reason, count] : drops)
      std::cout << fmt::format("{} dropped {}: {}\n", node, count, reason);
  std::cout << std::flush;
}

// All runs of the pipeline.
struct PipelineResults {
  PipelineBreakdown breakdown;
  std::uint64_t frames = 0;
  double seconds = 0, replay_cpu_s = 0;
  std::string gl_renderer;
  bool valid = true;
};

void add_run(PipelineResults& results, const NodeRun& run, const PipelineNodes& nodes) {
  const PipelineBreakdown breakdown = breakdown_of(run.frames, nodes);
  print_stages(run, breakdown, nodes);
  print_resources(run);
  results.valid &= is_valid_run(run);
  results.gl_renderer = run.gl_renderer;
  results.breakdown.add(breakdown);
  results.frames += run.counts.handled.at(nodes.rendering);
  results.seconds += run.counts.seconds;
  results.replay_cpu_s += run.replay_cpu_s;
}

ordered_json results_json(const PipelineResults& results, const std::string& prefix,
                          int frames_in_flight) {
  const PipelineBreakdown& all = results.breakdown;
  ordered_json entries = ordered_json::array();
  for (const auto& [stage, time_ms] : all.stages)
    entries.push_back(result_json(prefix + stage, time_ms));
  entries.push_back(
      result_json(prefix + "latency", all.latency,
                  {{"frames", results.frames},
                   {"frames_per_s", double(results.frames) / results.seconds},
                   {"in_flight", frames_in_flight},
                   {"replay_cpu_percent", 100 * results.replay_cpu_s / results.seconds},
                   {"stages_mean_ms", all.stages_mean_ms()},
                   {"heard_mean_ms", base::mean(all.received)},
                   {"explained_share", all.explained_fraction()}}));
  return entries;
}

// Returns the median message sizes of the topics with the largest messages.
std::vector<std::size_t> median_sizes(const recording::Recording& recording) {
  std::map<std::string, std::vector<double>> sizes;
  auto messages = recording.messages();
  while (const auto message = messages.next())
    if (!message->key_change && (message->channel->topic == bus::topics::ObjectPixelMap::name ||
                                 message->channel->topic == bus::topics::ObjectColour::name ||
                                 message->channel->topic == bus::topics::HullTile::name))
      sizes[message->channel->topic].push_back(double(message->cdr.size()));
  std::vector<std::size_t> medians;
  for (const auto& [topic, bytes] : sizes)
    medians.push_back(std::size_t(base::percentile(bytes, 0.5)));
  return medians;
}

void add_bus(const std::vector<BusTimes>& bus, ordered_json& entries) {
  base::TextTable table({{"bytes", true},
                         {"fivepipe", true},
                         {"ddsperf, waitset", true},
                         {"ddsperf, listener", true}});
  for (const BusTimes& times : bus) {
    const double ours_us = base::percentile(times.ours_us, 0.5),
                 waitset_us = base::percentile(times.ddsperf_us, 0.5),
                 listener_us = base::percentile(times.ddsperf_listener_us, 0.5);
    const auto relative = [&](double us) {
      return fmt::format("{:.1f} ({:.2f}x)", us, ours_us / us);
    };
    table.add({std::to_string(times.size_bytes), base::with_decimals(ours_us, 1),
               relative(waitset_us), relative(listener_us)});
    std::vector<double> ours_ms;
    for (const double us : times.ours_us) ours_ms.push_back(1e-3 * us);
    entries.push_back(result_json(
        fmt::format("bus/{}_bytes", times.size_bytes), ours_ms,
        {{"ddsperf_waitset_median_us", waitset_us}, {"ddsperf_listener_median_us", listener_us}}));
  }
  std::cout << "the bus alone: half a round trip, medians in us (fivepipe's time relative to "
               "ddsperf's)\n"
            << table.text() << std::flush;
}

}  // namespace

int bench_pipeline(const FromRecordingOptions& options, int bus_rounds) {
  const recording::Recording recording(options.recording);
  const MeasuredDeployment measured(recording, options);
  const config::Deployment& deployment = measured.deployment();
  const PipelineNodes nodes = nodes_of(deployment);
  NodeRunOptions run_options = measured.run_options(options);
  run_options.nodes = nodes.reconstruction;
  if (!nodes.simulation.empty()) run_options.nodes.push_back(nodes.simulation);
  run_options.nodes.push_back(nodes.rendering);
  run_options.checksums = false;
  run_options.order = replay::SendOrder::as_captured;
  PipelineResults results;
  for (int i = 0; i < options.runs; ++i) {
    const NodeRun run = run_nodes(recording, run_options);
    if (launch::signals_received() > 0) return 130;
    add_run(results, run, nodes);
  }
  ordered_json entries =
      results_json(results, fmt::format("pipeline/{}/", deployment.name), options.frames_in_flight);
  if (bus_rounds > 0)
    add_bus(time_bus(median_sizes(recording), bus_rounds, deployment.network_profile), entries);
  if (!options.json.empty())
    base::write_json(options.json, base::suite_json("pipeline", results.gl_renderer, entries));
  if (!results.valid)
    std::cerr
        << "do not compare these times: not every frame was handled, or a frame was dropped\n";
  return results.valid ? 0 : 1;
}

}  // namespace fivepipe::node_bench
