#include <cstdio>
#include <iostream>

#include "benchmarks/nodes/bus_ping.h"
#include "benchmarks/nodes/from_recording.h"
#include "benchmarks/nodes/pipeline_breakdown.h"
#include "benchmarks/nodes/times_table.h"
#include "common/base/result_file.h"
#include "common/base/timing.h"
#include "launch/cli/benchmarks.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::launch {
namespace {

node_bench::PipelineNodes nodes_of(const config::Deployment& deployment) {
  node_bench::PipelineNodes nodes;
  for (const config::Node& node : deployment.nodes) {
    const std::string program = config::program_of(node);
    if (program == "recon_node") nodes.reconstruction.push_back(node.name);
    if (program == "sim_node" && nodes.simulation.empty()) nodes.simulation = node.name;
    if (program == "render_node" && nodes.rendering.empty()) nodes.rendering = node.name;
  }
  if (nodes.reconstruction.empty() || nodes.rendering.empty())
    throw recording::RecordingError("deployment " + deployment.name +
                                    " has no reconstruction or no rendering node");
  return nodes;
}

void print(const node_bench::NodeRun& run, const node_bench::PipelineBreakdown& breakdown,
           const node_bench::PipelineNodes& nodes) {
  std::printf("%zu frames, %.1f frames/s\n", run.frames.size(),
              double(run.counts.handled.at(nodes.rendering)) / run.counts.seconds);
  node_bench::print_times_header();
  for (const auto& [stage, time_ms] : breakdown.stages) node_bench::print_times(stage, time_ms);
  std::printf("  %-44s %9.3f\n", "all stages", breakdown.stages_mean_ms());
  node_bench::print_times("capture's messages to composite", breakdown.latency);
  node_bench::print_times("measured here, until it was heard of", breakdown.received);
  std::printf("  the stages add up to %.1f %% of what was measured\n",
              100 * breakdown.explained_fraction());
  if (!breakdown.simulation.empty())
    std::printf("  beside it, the simulation: %.2f ms, waited for in %zu of %zu frames\n",
                base::mean(breakdown.simulation), breakdown.waited_for_state,
                breakdown.latency.size());
  for (const auto& [node, use] : run.use)
    std::printf("  %-20s CPU %3.0f %%, %.0f MB at most\n", node.c_str(),
                100 * use.cpu_s / run.counts.seconds, use.peak_memory_mb);
  std::printf("  %-20s CPU %3.0f %%\n", "(the replay itself)",
              100 * run.replay_cpu_s / run.counts.seconds);
  for (const auto& [node, drops] : run.drops)
    for (const auto& [reason, count] : drops)
      std::printf("  %s dropped %llu: %s\n", node.c_str(), static_cast<unsigned long long>(count),
                  reason.c_str());
  std::fflush(stdout);
}

// Median sizes of what goes over the bus, of the topics that carry much.
std::vector<std::size_t> sizes_of(const recording::Recording& recording) {
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

void add_bus(const std::vector<node_bench::BusTimes>& bus, std::vector<std::string>& results) {
  std::printf("the bus alone, half a round trip, medians [us]\n  %-12s %10s %22s %22s\n", "bytes",
              "ours", "ddsperf, waitset", "ddsperf, listener");
  for (const node_bench::BusTimes& times : bus) {
    const double ours_us = base::percentile(times.ours_us, 0.5),
                 waitset_us = base::percentile(times.ddsperf_us, 0.5),
                 listener_us = base::percentile(times.ddsperf_listener_us, 0.5);
    std::printf("  %-12zu %10.1f %14.1f (%.2fx) %14.1f (%.2fx)\n", times.size_bytes, ours_us,
                waitset_us, ours_us / waitset_us, listener_us, ours_us / listener_us);
    std::vector<double> ours_ms;
    for (const double us : times.ours_us) ours_ms.push_back(1e-3 * us);
    results.push_back(node_bench::result_json(
        "bus/" + std::to_string(times.size_bytes) + "_bytes", ours_ms,
        nlohmann::ordered_json::object(),
        {{"ddsperf_waitset_median_us", waitset_us}, {"ddsperf_listener_median_us", listener_us}},
        ""));
  }
  std::fflush(stdout);
}

}  // namespace

int bench_pipeline(const std::vector<std::string>& words) {
  node_bench::FromRecordingOptions options;
  bool without_bus = false;
  int bus_rounds = 2;
  CLI::App app(
      "All nodes but capture, fed from a recording without loss: frames a second, latency, where "
      "it goes stage by stage; and the bus alone beside ddsperf.\n\nExamples:\n"
      "  fivepipe bench pipeline --from session.mcap\n"
      "  fivepipe bench pipeline --from session.mcap --in-flight 1 --no-bus --json "
      "out/pipeline.json",
      "fivepipe bench pipeline");
  node_bench::add_from_recording_options(app, options);
  app.add_flag("--no-bus", without_bus, "without the bus alone");
  app.add_option("--bus-rounds", bus_rounds, "of the bus alone, in turn with ddsperf")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  if (const auto exit_code = node_bench::parsed(app, words)) return *exit_code;
  catch_signals();
  const recording::Recording recording(options.recording);
  const node_bench::MeasuredDeployment measured(recording, options);
  const node_bench::PipelineNodes nodes = nodes_of(measured.deployment());
  node_bench::NodeRunOptions run_options = measured.run_options(options);
  run_options.nodes = nodes.reconstruction;
  if (!nodes.simulation.empty()) run_options.nodes.push_back(nodes.simulation);
  run_options.nodes.push_back(nodes.rendering);
  run_options.checksums = false;
  run_options.order = replay::SendOrder::as_captured;
  bool complete = true;
  std::string renderer;
  std::vector<std::string> results;
  node_bench::PipelineBreakdown all;
  std::uint64_t frames = 0;
  double seconds = 0, replay_cpu_s = 0;
  const std::string prefix = "pipeline/" + measured.deployment().name + "/";
  for (int i = 0; i < options.runs; ++i) {
    const node_bench::NodeRun run = node_bench::run_nodes(recording, run_options);
    if (signals_received() > 0) return 130;
    const node_bench::PipelineBreakdown breakdown = node_bench::breakdown_of(run.frames, nodes);
    print(run, breakdown, nodes);
    complete &= node_bench::is_valid_run(run);
    renderer = run.gl_renderer;
    all.add(breakdown);
    frames += run.counts.handled.at(nodes.rendering);
    seconds += run.counts.seconds;
    replay_cpu_s += run.replay_cpu_s;
  }
  for (const auto& [stage, time_ms] : all.stages)
    results.push_back(node_bench::result_json(prefix + stage, time_ms,
                                              nlohmann::ordered_json::object(),
                                              nlohmann::ordered_json::object(), ""));
  const nlohmann::ordered_json counts{{"frames", frames},
                                      {"frames_per_s", double(frames) / seconds},
                                      {"in_flight", options.frames_in_flight},
                                      {"replay_cpu_percent", 100 * replay_cpu_s / seconds},
                                      {"stages_mean_ms", all.stages_mean_ms()},
                                      {"heard_mean_ms", base::mean(all.received)},
                                      {"explained_share", all.explained_fraction()}};
  results.push_back(node_bench::result_json(prefix + "latency", all.latency,
                                            nlohmann::ordered_json::object(), counts, ""));
  if (!without_bus)
    add_bus(node_bench::time_bus(sizes_of(recording), bus_rounds,
                                 measured.deployment().network_profile),
            results);
  if (!options.json.empty()) {
    if (options.json.has_parent_path())
      std::filesystem::create_directories(options.json.parent_path());
    base::write_file(options.json, base::suite_json("pipeline", renderer, results));
  }
  if (!complete)
    std::cerr << "not every frame was handled, or some were dropped: these times are not to be "
                 "compared\n";
  return complete ? 0 : 1;
}

}  // namespace fivepipe::launch
