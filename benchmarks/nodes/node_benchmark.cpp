#include "benchmarks/nodes/node_benchmark.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <iostream>
#include <nlohmann/json.hpp>

#include "benchmarks/nodes/node_breakdown.h"
#include "benchmarks/nodes/times_table.h"
#include "common/base/result_file.h"
#include "common/base/timing.h"
#include "common/base/usage_error.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::node_bench {
namespace {

using nlohmann::ordered_json;

const config::Node& find_node_or_program(const config::Deployment& deployment,
                                         const std::string& name) {
  if (const config::Node* node = config::find_node(deployment, name)) return *node;
  std::vector<std::string> known;
  for (const config::Node& node : deployment.nodes) {
    if (config::program_of(node) == name) return node;
    known.push_back(node.name);
  }
  throw base::UsageError(fmt::format("deployment {} has no node '{}'; its nodes are: {}",
                                     deployment.name, name, fmt::join(known, ", ")));
}

ordered_json counts_of(const NodeRun& run, const std::string& node) {
  ordered_json counts{
      {"frames", run.counts.expected.at(node)},
      {"handled", run.counts.handled.at(node)},
      {"cpu_percent", 100 * run.use.at(node).cpu_s / run.counts.seconds},
      {"replay_cpu_percent", 100 * run.replay_cpu_s / run.counts.seconds},
      {"peak_memory_mb", run.use.at(node).peak_memory_mb},
      {"dropped", dropped_by(run, node)},
  };
  for (const auto& [topic, digest] : run.outputs)
    counts["outputs"][topic] = {{"messages", digest.messages},
                                {"bytes", digest.bytes},
                                {"checksum", checksum_text(digest.checksum)}};
  return counts;
}

std::uint64_t checksum_of(const NodeRun& run) {
  std::uint64_t checksum = 0;
  for (const auto& [topic, digest] : run.outputs) checksum += digest.checksum;
  return checksum;
}

void print_times(const NodeRun& run, const NodeBreakdown& breakdown, const std::string& node) {
  std::cout << fmt::format("{}: {} frames, {} handled, {:.1f} frames/s\n", node,
                           run.counts.expected.at(node), run.counts.handled.at(node),
                           double(run.counts.handled.at(node)) / run.counts.seconds);
  base::TextTable table = times_table();
  for (const auto& [step, time_ms] : breakdown.steps) add_times(table, step, time_ms);
  add_times(table, "the node's own time", breakdown.own);
  add_times(table, "period, from frame to frame", breakdown.period);
  add_times(table, "latency, from sent to handled", breakdown.latency);
  std::cout << table.text()
            << fmt::format(
                   "period: own time {:.1f} %, transport {:.1f} %, idle {:.1f} %; {:.3f} ms longer "
                   "than the own time\n",
                   100 * breakdown.own_fraction(),
                   100 * (breakdown.explained_fraction() - breakdown.own_fraction()),
                   100 * (1 - breakdown.explained_fraction()),
                   base::mean(breakdown.period) - base::mean(breakdown.own));
}

void print_resources(const NodeRun& run, const std::string& node) {
  std::cout << fmt::format("CPU {:.0f} %, peak memory {:.0f} MB; the replay itself CPU {:.0f} %\n",
                           100 * run.use.at(node).cpu_s / run.counts.seconds,
                           run.use.at(node).peak_memory_mb,
                           100 * run.replay_cpu_s / run.counts.seconds);
  if (const auto drops = run.drops.find(node); drops != run.drops.end())
    for (const auto& [reason, count] : drops->second)
      std::cout << fmt::format("dropped {}: {}\n", count, reason);
  for (const auto& [topic, digest] : run.outputs)
    std::cout << fmt::format("{}: {} messages, {:.1f} MB, checksum {}\n", topic, digest.messages,
                             1e-6 * double(digest.bytes), checksum_text(digest.checksum));
  std::cout << std::flush;
}

// All runs of one node.
struct NodeResults {
  NodeBreakdown breakdown;
  ordered_json counts;         // of the last run
  std::uint64_t checksum = 0;  // of the last run
  std::string gl_renderer;
  bool valid = true;
};

void add_run(NodeResults& results, const NodeRun& run, const std::string& node, bool first) {
  const NodeBreakdown breakdown = breakdown_of(run.frames, node);
  print_times(run, breakdown, node);
  print_resources(run, node);
  results.valid &= is_valid_run(run);
  if (!first && checksum_of(run) != results.checksum) {
    std::cerr << "the output differs from the previous run: " << checksum_text(checksum_of(run))
              << "\n";
    results.valid = false;
  }
  results.checksum = checksum_of(run);
  results.gl_renderer = run.gl_renderer.empty() ? "no OpenGL" : run.gl_renderer;
  results.counts = counts_of(run, node);
  results.breakdown.add(breakdown);
}

ordered_json results_json(const NodeResults& results, const std::string& prefix, bool checksums) {
  const NodeBreakdown& all = results.breakdown;
  ordered_json counts = results.counts;
  counts["own_share"] = all.own_fraction();
  counts["explained_share"] = all.explained_fraction();
  ordered_json entries = ordered_json::array();
  for (const auto& [step, time_ms] : all.steps)
    entries.push_back(result_json(prefix + step, time_ms));
  entries.push_back(result_json(prefix + "own", all.own, counts,
                                checksums ? checksum_text(results.checksum) : ""));
  entries.push_back(result_json(prefix + "period", all.period));
  entries.push_back(result_json(prefix + "latency", all.latency));
  return entries;
}

}  // namespace

int bench_node(const std::string& name, const FromRecordingOptions& options, bool checksums) {
  const recording::Recording recording(options.recording);
  const MeasuredDeployment measured(&recording, options);
  const config::Node& node = find_node_or_program(measured.deployment(), name);
  const std::string program = config::program_of(node);
  if (program == "capture_node") {
    std::cerr << "capture_node reads cameras and files, not messages, so a recording holds only "
                 "its output; its times are in the report of `fivepipe up`\n";
    return 2;
  }
  NodeRunOptions run_options = measured.run_options(options);
  run_options.nodes = {node.name};
  run_options.checksums = checksums;
  NodeResults results;
  for (int i = 0; i < options.runs; ++i) {
    const NodeRun run = run_nodes(recording, run_options);
    if (launch::signals_received() > 0) return 130;
    add_run(results, run, node.name, i == 0);
  }
  if (!options.json.empty()) {
    const std::string prefix =
        fmt::format("{}/{}/{}/", program, measured.deployment().name, node.name);
    base::write_json(options.json, base::suite_json(program, results.gl_renderer,
                                                    results_json(results, prefix, checksums)));
  }
  if (!results.valid)
    std::cerr << "do not compare these times: not every frame was handled, a frame was dropped, or "
                 "the output differs between runs\n";
  return results.valid ? 0 : 1;
}

}  // namespace fivepipe::node_bench
