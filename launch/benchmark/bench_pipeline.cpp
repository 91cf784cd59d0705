#include <cstdio>
#include <iostream>

#include "common/bench/report.h"
#include "common/bench/timing.h"
#include "launch/benchmark/benchmarks.h"
#include "launch/benchmark/bus_ping.h"
#include "launch/benchmark/from_recording.h"
#include "launch/benchmark/pipeline_account.h"
#include "launch/benchmark/times_table.h"
#include "launch/interrupt.h"

namespace fivepipe {
namespace {

PipelineNodes nodes_of(const Deployment& deployment) {
  PipelineNodes nodes;
  for (const Node& node : deployment.nodes) {
    const std::string program = program_of(node);
    if (program == "recon_node") nodes.reconstruction.push_back(node.name);
    if (program == "sim_node" && nodes.simulation.empty()) nodes.simulation = node.name;
    if (program == "render_node" && nodes.rendering.empty()) nodes.rendering = node.name;
  }
  if (nodes.reconstruction.empty() || nodes.rendering.empty()) throw recording::RecordingError("deployment " + deployment.name + " has no reconstruction or no rendering node");
  return nodes;
}

void print(const NodeRun& run, const PipelineAccount& account, const PipelineNodes& nodes) {
  std::printf("%zu frames, %.1f frames/s\n", run.frames.size(), double(run.counts.handled.at(nodes.rendering)) / run.counts.seconds);
  print_times_header();
  for (const auto& [stage, time_ms] : account.stages) print_times(stage, time_ms);
  std::printf("  %-44s %9.3f\n", "all stages", account.stages_mean_ms());
  print_times("capture's messages to composite", account.latency);
  print_times("measured here, until it was heard of", account.heard);
  std::printf("  the stages add up to %.1f %% of what was measured\n", 100 * account.explained_share());
  if (!account.simulation.empty())
    std::printf("  beside it, the simulation: %.2f ms, waited for in %zu of %zu frames\n", bench::mean(account.simulation), account.waited_for_state, account.latency.size());
  for (const auto& [node, use] : run.use) std::printf("  %-20s CPU %3.0f %%, %.0f MB at most\n", node.c_str(), 100 * use.cpu_s / run.counts.seconds, use.peak_memory_mb);
  std::printf("  %-20s CPU %3.0f %%\n", "(the replay itself)", 100 * run.replay_cpu_s / run.counts.seconds);
  for (const auto& [node, drops] : run.drops)
    for (const auto& [reason, count] : drops) std::printf("  %s dropped %llu: %s\n", node.c_str(), static_cast<unsigned long long>(count), reason.c_str());
  std::fflush(stdout);
}

// Median sizes of what goes over the bus, of the topics that carry much.
std::vector<std::size_t> sizes_of(const recording::Recording& recording) {
  std::map<std::string, std::vector<double>> sizes;
  auto messages = recording.messages();
  while (const auto message = messages.next())
    if (!message->key_change && (message->channel->topic == topics::ObjectPixelMap::name || message->channel->topic == topics::ObjectColour::name || message->channel->topic == topics::HullTile::name))
      sizes[message->channel->topic].push_back(double(message->cdr.size()));
  std::vector<std::size_t> medians;
  for (const auto& [topic, bytes] : sizes) medians.push_back(std::size_t(bench::percentile(bytes, 0.5)));
  return medians;
}

void add_bus(const std::vector<BusTimes>& bus, std::vector<std::string>& results) {
  std::printf("the bus alone, half a round trip, medians [us]\n  %-12s %10s %22s %22s\n", "bytes", "ours", "ddsperf, waitset", "ddsperf, listener");
  for (const BusTimes& times : bus) {
    const double ours_us = bench::percentile(times.ours_us, 0.5), waitset_us = bench::percentile(times.ddsperf_us, 0.5), listener_us = bench::percentile(times.ddsperf_listener_us, 0.5);
    std::printf("  %-12zu %10.1f %14.1f (%.2fx) %14.1f (%.2fx)\n", times.size_bytes, ours_us, waitset_us, ours_us / waitset_us, listener_us, ours_us / listener_us);
    std::vector<double> ours_ms;
    for (const double us : times.ours_us) ours_ms.push_back(1e-3 * us);
    results.push_back(result_json("bus/" + std::to_string(times.size_bytes) + "_bytes", ours_ms, nlohmann::ordered_json::object(),
                                  {{"ddsperf_waitset_median_us", waitset_us}, {"ddsperf_listener_median_us", listener_us}}, ""));
  }
  std::fflush(stdout);
}

}  // namespace

int bench_pipeline(const std::vector<std::string>& words) {
  FromRecordingOptions options;
  bool without_bus = false;
  int bus_rounds = 2;
  CLI::App app("All nodes but capture, fed from a recording without loss: frames a second, latency, where it goes stage by stage; and the bus alone beside ddsperf.\n\nExamples:\n"
               "  fivepipe bench pipeline --from session.mcap\n"
               "  fivepipe bench pipeline --from session.mcap --in-flight 1 --no-bus --json out/pipeline.json",
               "fivepipe bench pipeline");
  add_from_recording_options(app, options);
  app.add_flag("--no-bus", without_bus, "without the bus alone");
  app.add_option("--bus-rounds", bus_rounds, "of the bus alone, in turn with ddsperf")->check(CLI::Range(1, 20))->capture_default_str();
  if (const auto exit_code = parsed(app, words)) return *exit_code;
  catch_signals();
  const recording::Recording recording(options.recording);
  const MeasuredDeployment measured(recording, options);
  const PipelineNodes nodes = nodes_of(measured.deployment());
  NodeRunOptions run_options = measured.run_options(options);
  run_options.nodes = nodes.reconstruction;
  if (!nodes.simulation.empty()) run_options.nodes.push_back(nodes.simulation);
  run_options.nodes.push_back(nodes.rendering);
  run_options.checksums = false;
  run_options.order = SendOrder::as_captured;
  bool complete = true;
  std::string renderer;
  std::vector<std::string> results;
  PipelineAccount all;
  std::uint64_t frames = 0;
  double seconds = 0, replay_cpu_s = 0;
  const std::string prefix = "pipeline/" + measured.deployment().name + "/";
  for (int i = 0; i < options.runs; ++i) {
    const NodeRun run = run_nodes(recording, run_options);
    if (signals_received() > 0) return 130;
    const PipelineAccount account = account_of(run.frames, nodes);
    print(run, account, nodes);
    complete &= is_sound(run);
    renderer = run.gl_renderer;
    all.add(account);
    frames += run.counts.handled.at(nodes.rendering);
    seconds += run.counts.seconds;
    replay_cpu_s += run.replay_cpu_s;
  }
  for (const auto& [stage, time_ms] : all.stages) results.push_back(result_json(prefix + stage, time_ms, nlohmann::ordered_json::object(), nlohmann::ordered_json::object(), ""));
  const nlohmann::ordered_json counts{{"frames", frames}, {"frames_per_s", double(frames) / seconds}, {"in_flight", options.frames_in_flight}, {"replay_cpu_percent", 100 * replay_cpu_s / seconds},
                                      {"stages_mean_ms", all.stages_mean_ms()}, {"heard_mean_ms", bench::mean(all.heard)}, {"explained_share", all.explained_share()}};
  results.push_back(result_json(prefix + "latency", all.latency, nlohmann::ordered_json::object(), counts, ""));
  if (!without_bus) add_bus(time_bus(sizes_of(recording), bus_rounds, measured.deployment().network_profile), results);
  if (!options.json.empty()) {
    if (options.json.has_parent_path()) std::filesystem::create_directories(options.json.parent_path());
    bench::write_file(options.json, bench::suite_json("pipeline", renderer, results));
  }
  if (!complete) std::cerr << "not every frame was handled, or some were dropped: these times are not to be compared\n";
  return complete ? 0 : 1;
}

}  // namespace fivepipe
