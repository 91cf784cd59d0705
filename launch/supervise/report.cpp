#include "launch/supervise/report.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/realtime.h"
#include "common/pipeline/node/status_names.h"
#include "launch/supervise/status/largest_counts.h"
#include "launch/supervise/work_per_set.h"

namespace fivepipe::launch {
namespace {

using nlohmann::json;
using Processes = std::vector<ProcessStatus>;

std::map<std::string, std::uint64_t> summed(
    const Processes& processes, std::map<std::string, std::uint64_t> ProcessStatus::*counts) {
  std::map<std::string, std::uint64_t> sums;
  for (const ProcessStatus& process : processes)
    for (const auto& [name, count] : process.*counts) sums[name] += count;
  return sums;
}

// Returns, for each node that has the count `name`, the sum over its processes.
std::vector<std::uint64_t> per_node(const StatusRegistry& statuses, const std::string& name) {
  std::vector<std::uint64_t> sums;
  for (const auto& [node, processes] : statuses.processes()) {
    const auto counts = summed(processes, &ProcessStatus::counts);
    if (const auto found = counts.find(name); found != counts.end()) sums.push_back(found->second);
  }
  return sums;
}

std::uint64_t min_count(const std::vector<std::uint64_t>& counts) {
  return counts.empty() ? 0 : *std::min_element(counts.begin(), counts.end());
}
std::uint64_t max_count(const std::vector<std::uint64_t>& counts) {
  return counts.empty() ? 0 : *std::max_element(counts.begin(), counts.end());
}

// The smallest count over the recon_nodes. sim_node has a count of the same name.
std::uint64_t complete_sets(const ReportInput& input) {
  std::vector<std::uint64_t> sums;
  const auto processes = input.statuses.processes();
  for (const ProgramHistory& program : input.programs) {
    if (program.program != "recon_node") continue;
    const auto node = processes.find(program.name);
    sums.push_back(node == processes.end()
                       ? 0
                       : summed(node->second, &ProcessStatus::counts)[node::kFrameSetsComplete]);
  }
  return min_count(sums);
}

std::map<std::string, Latency> busiest_latencies(const Processes& processes) {
  std::map<std::string, Latency> latencies;
  for (const ProcessStatus& process : processes)
    for (const auto& [name, latency] : process.latencies)
      if (auto [at, is_new] = latencies.try_emplace(name, latency);
          !is_new && latency.count > at->second.count)
        at->second = latency;
  return latencies;
}

json json_of(const Latency& latency) {
  return {{"p50", latency.p50_ms},
          {"p95", latency.p95_ms},
          {"p99", latency.p99_ms},
          {"max", latency.max_ms},
          {"count", latency.count}};
}

// The latencies of the render_node with the largest 99th percentile; null if there is none.
json frame_latency(const StatusRegistry& statuses) {
  json worst;
  for (const auto& [node, processes] : statuses.processes()) {
    const auto latencies = busiest_latencies(processes);
    const auto found = latencies.find(node::kCaptureToComposite);
    if (found == latencies.end() || found->second.count == 0) continue;
    if (worst.is_null() || found->second.p99_ms > worst["p99"].get<double>())
      worst = json_of(found->second);
  }
  return worst;
}

// The OpenGL renderer of the first node, by name, that uses OpenGL; "unknown" if none does.
std::string gl_renderer(const StatusRegistry& statuses) {
  for (const auto& [node, processes] : statuses.processes())
    for (const ProcessStatus& process : processes)
      if (!process.gl_renderer.empty()) return process.gl_renderer;
  return "unknown";
}

std::set<std::string> empty_cameras(const StatusRegistry& statuses) {
  std::set<std::string> cameras;
  for (const auto& [node, processes] : statuses.processes())
    for (const ProcessStatus& process : processes)
      for (const auto& [camera, frames] : process.empty_cameras) cameras.insert(camera);
  return cameras;
}

// Messages that nodes refused, by the process that sent them.
Counts all_refused(const StatusRegistry& statuses) {
  Counts refused;
  for (const auto& [node, processes] : statuses.processes())
    for (const ProcessStatus& process : processes)
      for (const auto& [sender, count] : refused_from(process.counts)) refused[sender] += count;
  return refused;
}

json collisions(const StatusRegistry& statuses) {
  std::map<std::string, CollisionTotals> sums;
  for (const auto& [node, processes] : statuses.processes())
    for (const ProcessStatus& process : processes)
      for (const auto& [object, totals] : process.collisions) sums[object] += totals;
  json by_object = json::object();
  for (const auto& [object, sum] : sums)
    by_object[object] = {
        {"frames", sum.frames}, {"points", sum.points}, {"first_contacts", sum.first_contacts}};
  return by_object;
}

std::vector<std::string> duplicate_nodes(const StatusRegistry& statuses) {
  std::vector<std::string> nodes;
  for (const DuplicateNode& duplicate : statuses.duplicates()) nodes.push_back(duplicate.node);
  return nodes;
}

json json_of_topics(const Processes& processes) {
  std::map<std::string, TopicTotals> sums;
  for (const ProcessStatus& process : processes)
    for (const auto& [topic, totals] : process.topics) sums[topic] += totals;
  json topics = json::object();
  for (const auto& [topic, sum] : sums)
    topics[topic] = {{"sent", sum.sent},
                     {"not_sent", sum.not_sent},
                     {"received", sum.received},
                     {"recorded", sum.recorded},
                     {"lost", sum.lost}};
  return topics;
}

json json_of_hosts(const std::vector<ComparedHost>& hosts) {
  json by_name = json::object();
  for (const ComparedHost& host : hosts) {
    if (host.state.speaker.program != "up") continue;
    json& described = by_name[host.state.speaker.host];
    described = {{"machine", host.state.machine},
                 {"version", host.state.version},
                 {"clock_offset_ms", nullptr},
                 {"clock_error_ms", nullptr}};
    if (!host.clock) continue;
    described["clock_offset_ms"] = 1e-6 * double(host.clock->offset_ns);
    described["clock_error_ms"] = 1e-6 * double(host.clock->error_ns);
  }
  return by_name;
}

// Returns the stop by the clock of the node's host; by that of this host if they are not compared.
std::int64_t stop_stamp_of(const ProgramHistory& program, const ReportInput& input) {
  std::int64_t stamp_ns = input.stop_stamp_ns;
  for (const ComparedHost& host : input.hosts)
    if (host.state.speaker == HostSpeaker{program.other_host, "up"} && host.clock)
      stamp_ns += host.clock->offset_ns;
  return stamp_ns;
}

double cpu_percent(const ProcessStatus& process, std::int64_t stop_stamp_ns) {
  const double uptime_s = base::difference_s(stop_stamp_ns, process.start_stamp_ns);
  return uptime_s > 0 ? 100 * process.cpu_s / uptime_s : 0;
}

json json_of_processes(const ProgramHistory& program) {
  json restarts = json::array(), pids = json::array();
  for (std::size_t i = 0; i < program.processes.size(); ++i) {
    pids.push_back(program.processes[i].pid);
    if (i > 0)
      restarts.push_back(
          {{"pid", program.processes[i].pid}, {"cause", program.processes[i - 1].end}});
  }
  return {{"program", program.program},
          {"pids", pids},
          {"restarts", restarts},
          {"end", program.processes.empty() ? "not started here" : program.processes.back().end}};
}

json json_of_node(const ProgramHistory& program, const Processes& processes,
                  std::int64_t stop_stamp_ns) {
  json node = json_of_processes(program);
  if (processes.empty()) {
    node["status"] = "none received";
    return node;
  }
  const ProcessStatus& last = processes.back();
  double cpu_s = 0, memory_mb = 0;
  for (const ProcessStatus& process : processes) {
    cpu_s += process.cpu_s;
    memory_mb = std::max(memory_mb, process.memory_mb);
  }
  node["status"] = last.final_report ? "final report" : "last status before it died";
  node["cpu_s"] = cpu_s;
  node["cpu_percent"] = cpu_percent(last, stop_stamp_ns);  // of one core; newest process
  node["memory_mb"] = memory_mb;
  node["counts"] = largest(summed(processes, &ProcessStatus::counts));
  node["topics"] = json_of_topics(processes);
  node["drops"] = largest_drops(summed(processes, &ProcessStatus::drops));
  node["latencies_ms"] = json::object();
  for (const auto& [name, latency] : busiest_latencies(processes))
    node["latencies_ms"][name] = json_of(latency);
  node["diagnostics"] = last.diagnostics;
  return node;
}

json json_of_recorder(const ReportInput& input) {
  if (!input.recorder) return nullptr;
  const RecorderHistory& recorder = *input.recorder;
  json described = {{"file", recorder.file},
                    {"pid", recorder.pid},
                    {"end", recorder.end},
                    {"complete", recorder.complete},
                    {"ended_after_s", nullptr}};
  if (recorder.ended_after_s) described["ended_after_s"] = *recorder.ended_after_s;
  TopicTotals sum;
  if (const ProcessStatus* status = input.statuses.newest(recorder.name))
    for (const auto& [topic, totals] : status->topics) sum += totals;
  described["received"] = sum.received;
  described["recorded"] = sum.recorded;
  described["lost"] = sum.lost;
  return described;
}

}  // namespace

std::uint64_t frames_composited(const StatusRegistry& statuses) {
  return min_count(per_node(statuses, node::kFramesComposited));
}

json report_from(const ReportInput& input) {
  const auto processes = input.statuses.processes();
  const std::uint64_t composited = frames_composited(input.statuses);
  const double composited_for_s =
      input.first_composited_stamp_ns
          ? base::difference_s(input.stop_stamp_ns, *input.first_composited_stamp_ns)
          : 0;

  std::map<std::string, std::uint64_t> dropped = input.drops;
  json nodes = json::object();
  for (const ProgramHistory& program : input.programs) {
    const auto found = processes.find(program.name);
    const Processes of_node = found == processes.end() ? Processes{} : found->second;
    nodes[program.name] = json_of_node(program, of_node, stop_stamp_of(program, input));
    if (const auto simulation = input.simulations.entries().find(program.name);
        simulation != input.simulations.entries().end())
      nodes[program.name]["simulation"] = json_of(simulation->second);
    for (const auto& [reason, count] : summed(of_node, &ProcessStatus::drops))
      dropped[reason] += count;
  }
  const double frame_rate_hz =
      composited > 1 && composited_for_s > 0 ? double(composited - 1) / composited_for_s : 0.0;
  const json work = core_ms_per_set(input, composited);
  return {
      {"version", input.version},
      {"commit", input.commit},
      {"build_type", input.build_type},
      {"machine",
       {{"cpu", input.cpu}, {"cores", input.cores}, {"gl_renderer", gl_renderer(input.statuses)}}},
      {"deployment", input.deployment},
      {"ended_by", input.ended_by},
      {"duration_s", 1e-9 * double(input.stop_stamp_ns - input.start_stamp_ns)},
      {"frames",
       {{"captured", max_count(per_node(input.statuses, node::kFramesCaptured))},
        {"complete", complete_sets(input)},
        {"composited", composited},
        {"dropped", largest_drops(dropped)}}},
      {"refused_from", largest(all_refused(input.statuses))},
      {"frame_rate_hz", frame_rate_hz},
      {"core_ms_per_set", work},
      {"rate_bound", what_bounds_the_rate(input, work, composited, frame_rate_hz)},
      {"latency_ms", frame_latency(input.statuses)},
      {"collisions", collisions(input.statuses)},
      {"empty_cameras", empty_cameras(input.statuses)},
      {"duplicate_nodes", duplicate_nodes(input.statuses)},
      {"recorder", json_of_recorder(input)},
      {"hosts", json_of_hosts(input.hosts)},
      {"nodes", nodes}};
}

}  // namespace fivepipe::launch
