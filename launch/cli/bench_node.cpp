#include <algorithm>
#include <cstdio>
#include <iostream>

#include "benchmarks/nodes/from_recording.h"
#include "benchmarks/nodes/node_breakdown.h"
#include "benchmarks/nodes/times_table.h"
#include "common/base/result_file.h"
#include "common/base/timing.h"
#include "common/base/usage_error.h"
#include "launch/cli/benchmarks.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::launch {
namespace {

// A node by its name, or the first that runs this program.
const config::Node& node_meant(const config::Deployment& deployment, const std::string& word) {
  if (const config::Node* node = config::find_node(deployment, word)) return *node;
  std::string known;
  for (const config::Node& node : deployment.nodes) {
    if (config::program_of(node) == word) return node;
    known += " " + node.name;
  }
  throw base::UsageError("no node '" + word + "' in deployment " + deployment.name +
                         "; there are:" + known);
}

nlohmann::ordered_json counts_of(const node_bench::NodeRun& run, const std::string& node) {
  nlohmann::ordered_json counts;
  counts["frames"] = run.counts.expected.at(node);
  counts["handled"] = run.counts.handled.at(node);
  counts["cpu_percent"] = 100 * run.use.at(node).cpu_s / run.counts.seconds;
  counts["replay_cpu_percent"] = 100 * run.replay_cpu_s / run.counts.seconds;
  counts["peak_memory_mb"] = run.use.at(node).peak_memory_mb;
  counts["dropped"] = node_bench::dropped_by(run, node);
  for (const auto& [topic, digest] : run.outputs)
    counts["outputs"][topic] = {{"messages", digest.messages},
                                {"bytes", digest.bytes},
                                {"checksum", node_bench::checksum_text(digest.checksum)}};
  return counts;
}

std::uint64_t checksum_of(const node_bench::NodeRun& run) {
  std::uint64_t checksum = 0;
  for (const auto& [topic, digest] : run.outputs) checksum += digest.checksum;
  return checksum;
}

void print(const node_bench::NodeRun& run, const node_bench::NodeBreakdown& breakdown,
           const std::string& node) {
  std::printf("%s: %llu frames, %llu handled, %.1f frames/s\n", node.c_str(),
              static_cast<unsigned long long>(run.counts.expected.at(node)),
              static_cast<unsigned long long>(run.counts.handled.at(node)),
              double(run.counts.handled.at(node)) / run.counts.seconds);
  node_bench::print_times_header();
  for (const auto& [step, time_ms] : breakdown.steps) node_bench::print_times(step, time_ms);
  node_bench::print_times("its own time", breakdown.own);
  node_bench::print_times("from frame to frame", breakdown.period);
  node_bench::print_times("from sent to handled", breakdown.latency);
  std::printf(
      "  of the time from frame to frame: own %.1f %%, transport %.1f %%, rest %.1f %% (%.3f ms "
      "beyond its own)\n",
      100 * breakdown.own_fraction(),
      100 * (breakdown.explained_fraction() - breakdown.own_fraction()),
      100 * (1 - breakdown.explained_fraction()),
      base::mean(breakdown.period) - base::mean(breakdown.own));
  std::printf("  CPU %.0f %%, %.0f MB at most; the replay itself CPU %.0f %%\n",
              100 * run.use.at(node).cpu_s / run.counts.seconds, run.use.at(node).peak_memory_mb,
              100 * run.replay_cpu_s / run.counts.seconds);
  if (const auto drops = run.drops.find(node); drops != run.drops.end())
    for (const auto& [reason, count] : drops->second)
      std::printf("  dropped %llu: %s\n", static_cast<unsigned long long>(count), reason.c_str());
  for (const auto& [topic, digest] : run.outputs)
    std::printf("  %s: %llu messages, %.1f MB, checksum %s\n", topic.c_str(),
                static_cast<unsigned long long>(digest.messages), 1e-6 * double(digest.bytes),
                node_bench::checksum_text(digest.checksum).c_str());
  std::fflush(stdout);
}

}  // namespace

int bench_node(const std::string& word, const std::vector<std::string>& words) {
  node_bench::FromRecordingOptions options;
  bool without_checksum = false;
  CLI::App app(
      "One node alone, fed from a recording without loss: time by step, what the replay adds, CPU, "
      "memory, checksum of its output.\n\nExamples:\n"
      "  fivepipe bench recon_node --from session.mcap\n"
      "  fivepipe bench simulation --from session.mcap --json out/simulation.json --runs 5",
      "fivepipe bench " + word);
  node_bench::add_from_recording_options(app, options);
  app.add_flag("--no-checksum", without_checksum, "don't read what the node writes");
  if (const auto exit_code = node_bench::parsed(app, words)) return *exit_code;
  catch_signals();
  const recording::Recording recording(options.recording);
  const node_bench::MeasuredDeployment measured(recording, options);
  const config::Node& node = node_meant(measured.deployment(), word);
  node_bench::NodeRunOptions run_options = measured.run_options(options);
  run_options.nodes = {node.name};
  run_options.checksums = !without_checksum;
  if (config::program_of(node) == "capture_node") {
    std::cerr << "capture_node's inputs are cameras and files, not messages: a recording holds "
                 "what it makes of them. `fivepipe up` runs it; its report has its times\n";
    return 2;
  }
  node_bench::NodeBreakdown all;
  std::vector<std::string> results;
  std::string renderer;
  std::uint64_t checksum = 0;
  bool complete = true;
  nlohmann::ordered_json counts;
  for (int i = 0; i < options.runs; ++i) {
    const node_bench::NodeRun run =
        node_bench::run_nodes(recording, run_options);  // throws when interrupted, too
    if (signals_received() > 0) return 130;
    const node_bench::NodeBreakdown breakdown = node_bench::breakdown_of(run.frames, node.name);
    print(run, breakdown, node.name);
    complete &= node_bench::is_valid_run(run);
    if (i > 0 && checksum_of(run) != checksum) {
      std::cerr << "its output differs from that of the run before: "
                << node_bench::checksum_text(checksum_of(run)) << "\n";
      complete = false;
    }
    checksum = checksum_of(run);
    renderer = run.gl_renderer.empty() ? "no OpenGL" : run.gl_renderer;
    counts = counts_of(run, node.name);
    for (const auto& [step, time_ms] : breakdown.steps) {
      auto known = std::find_if(all.steps.begin(), all.steps.end(),
                                [&](const auto& s) { return s.first == step; });
      if (known == all.steps.end()) known = all.steps.insert(all.steps.end(), {step, {}});
      known->second.insert(known->second.end(), time_ms.begin(), time_ms.end());
    }
    all.own.insert(all.own.end(), breakdown.own.begin(), breakdown.own.end());
    all.period.insert(all.period.end(), breakdown.period.begin(), breakdown.period.end());
    all.transport.insert(all.transport.end(), breakdown.transport.begin(),
                         breakdown.transport.end());
    all.latency.insert(all.latency.end(), breakdown.latency.begin(), breakdown.latency.end());
  }
  if (!options.json.empty()) {
    const std::string prefix =
        config::program_of(node) + "/" + measured.deployment().name + "/" + node.name + "/";
    const std::string text = without_checksum ? "" : node_bench::checksum_text(checksum);
    counts["own_share"] = all.own_fraction();
    counts["explained_share"] = all.explained_fraction();
    for (const auto& [step, time_ms] : all.steps)
      results.push_back(node_bench::result_json(prefix + step, time_ms,
                                                nlohmann::ordered_json::object(),
                                                nlohmann::ordered_json::object(), ""));
    results.push_back(node_bench::result_json(prefix + "own", all.own,
                                              nlohmann::ordered_json::object(), counts, text));
    results.push_back(node_bench::result_json(prefix + "period", all.period,
                                              nlohmann::ordered_json::object(),
                                              nlohmann::ordered_json::object(), ""));
    results.push_back(node_bench::result_json(prefix + "latency", all.latency,
                                              nlohmann::ordered_json::object(),
                                              nlohmann::ordered_json::object(), ""));
    if (options.json.has_parent_path())
      std::filesystem::create_directories(options.json.parent_path());
    base::write_file(options.json, base::suite_json(config::program_of(node), renderer, results));
  }
  if (!complete)
    std::cerr << "not every frame was handled, some were dropped, or outputs differ: these times "
                 "are not to be compared\n";
  return complete ? 0 : 1;
}

}  // namespace fivepipe::launch
