#include "benchmarks/nodes/pipeline/pipeline_benchmark.h"

#include <fmt/format.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "benchmarks/nodes/pipeline/live_run.h"
#include "benchmarks/nodes/pipeline/pipeline_report.h"
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
    if (config::draws_for_viewer(node)) nodes.rendering = node.name;
  }
  if (nodes.reconstruction.empty() || nodes.rendering.empty())
    throw recording::RecordingError(
        fmt::format("deployment {} needs a recon_node and a render_node", deployment.name));
  return nodes;
}

std::vector<std::string> names_of(const PipelineNodes& nodes) {
  std::vector<std::string> names = nodes.reconstruction;
  for (const std::string& name : {nodes.capture, nodes.simulation, nodes.rendering})
    if (!name.empty()) names.push_back(name);
  return names;
}

// "video files", "synthetic cameras, segmented before the start": what capture_node reads.
std::string sources_text(const config::CaptureConfig& capture) {
  std::string text;
  for (const auto& [camera, source] : capture.sources) {
    const std::string kind =
        std::holds_alternative<config::VideoSource>(source)       ? "image files"
        : std::holds_alternative<config::SyntheticSource>(source) ? "synthetic cameras"
        : std::holds_alternative<config::V4l2Source>(source)      ? "V4L2 cameras"
        : std::holds_alternative<config::GenicamSource>(source)   ? "GenICam cameras"
                                                                  : "video streams";
    if (text.find(kind) == std::string::npos) text += (text.empty() ? "" : " and ") + kind;
  }
  return capture.precomputed_frames > 0 ? text + ", segmented before the start" : text;
}

// Returns the median message sizes of the topics with the largest messages.
std::vector<std::size_t> median_sizes(const recording::Recording& recording) {
  std::map<std::string, std::vector<double>> sizes;
  auto messages = recording.messages();
  while (const auto message = messages.next())
    if (!message->key_change && (message->channel->topic == bus::topics::ObjectPixelMap::name ||
                                 message->channel->topic == bus::topics::ObjectColour::name ||
                                 message->channel->topic == bus::topics::ObjectCoverage::name ||
                                 message->channel->topic == bus::topics::HullTile::name))
      sizes[message->channel->topic].push_back(double(message->cdr.size()));
  std::vector<std::size_t> medians;
  for (const auto& [topic, bytes] : sizes)
    medians.push_back(std::size_t(base::percentile(bytes, 0.5)));
  return medians;
}

PipelineResult result_of(const RunObservations& observed, const PipelineNodes& nodes,
                         int max_in_flight) {
  PipelineResult result;
  result.breakdown = breakdown_of(observed.frames, nodes);
  result.agreement =
      compared(result.breakdown.by_frame, outside_stages(observed.messages, nodes, max_in_flight));
  result.gl_renderer = observed.gl_renderer;
  return result;
}

void print(const PipelineResult& result, const RunObservations& observed,
           const std::map<std::string, ProcessUse>& use) {
  print_stages(result);
  print_agreement(result.agreement, observed.no_messages);
  print_resources(result, use, observed);
}

int finish(const FromRecordingOptions& options, const std::string& suite,
           const PipelineResult& result, const ordered_json& entries, bool valid) {
  if (!options.json.empty())
    base::write_json(options.json, base::suite_json(suite, result.gl_renderer, entries));
  if (!valid)
    std::cerr
        << "do not compare these times: not every frame was handled, or a frame was dropped\n";
  return valid ? 0 : 1;
}

}  // namespace

int bench_replayed_pipeline(const FromRecordingOptions& options, int bus_rounds) {
  const recording::Recording recording(options.recording);
  const MeasuredDeployment measured(&recording, options);
  const config::Deployment& deployment = measured.deployment();
  const PipelineNodes nodes = nodes_of(deployment);
  NodeRunOptions run_options = measured.run_options(options);
  run_options.nodes = names_of(nodes);
  run_options.checksums = false;
  run_options.trace_bus = true;
  run_options.order = replay::SendOrder::as_captured;
  std::cout << fmt::format(
      "{} WITHOUT capture_node: a recording feeds the other nodes, {} frames in flight\n",
      deployment.name, options.frames_in_flight);
  PipelineResult all;
  bool valid = true;
  for (int i = 0; i < options.runs; ++i) {
    const NodeRun run = run_nodes(recording, run_options);
    if (launch::signals_received() > 0) return 130;
    PipelineResult result = result_of(run, nodes, 0);
    result.frames = run.counts.handled.at(nodes.rendering);
    result.seconds = run.counts.seconds;
    result.replay_cpu_s = run.replay_cpu_s;
    print(result, run, run.use);
    valid &= is_valid_run(run);
    all.add(result);
  }
  ordered_json entries =
      results_json(all, fmt::format("pipeline/{}/", deployment.name),
                   {{"in_flight", options.frames_in_flight},
                    {"replay_cpu_percent", 100 * all.replay_cpu_s / all.seconds}});
  if (bus_rounds > 0) {
    const auto bus = time_bus(median_sizes(recording), bus_rounds);
    print_bus(bus);
    for (const ordered_json& entry : bus_json(bus)) entries.push_back(entry);
  }
  return finish(options, "pipeline", all, entries, valid);
}

int bench_live_pipeline(const FromRecordingOptions& options, double duration_s) {
  const MeasuredDeployment measured(nullptr, options);
  const config::Deployment& deployment = measured.deployment();
  PipelineNodes nodes = nodes_of(deployment);
  const config::Node* const first = config::first_capture_node(deployment);
  if (!first)
    throw recording::RecordingError(
        fmt::format("deployment {} has no capture_node; use --from", deployment.name));
  nodes.capture = first->name;
  const auto* const capture = &std::get<config::CaptureConfig>(first->config);
  NodesToStart run_options = measured.run_options(options);
  run_options.nodes = names_of(nodes);
  std::cout << fmt::format("{} with capture_node from {}, {} frames in flight\n", deployment.name,
                           sources_text(*capture), capture->max_frames_in_flight);
  PipelineResult all;
  for (int i = 0; i < options.runs; ++i) {
    const LiveRun run = run_live(run_options, duration_s);
    PipelineResult result = result_of(run, nodes, capture->max_frames_in_flight);
    result.frames = run.frames.size();
    result.seconds = run.seconds;
    print(result, run, run.use);
    all.add(result);
  }
  return finish(options, "pipeline_with_capture", all,
                results_json(all, fmt::format("pipeline_with_capture/{}/", deployment.name),
                             {{"in_flight", capture->max_frames_in_flight}}),
                all.frames > 0);
}

}  // namespace fivepipe::node_bench
