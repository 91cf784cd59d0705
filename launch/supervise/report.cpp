#include "launch/supervise/report.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <set>

#include "common/pipeline/node/status_names.h"

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

// Of every node that counts `name` at all: its sum over its processes.
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

// frame_sets_complete of the reconstruction alone: the simulation counts the same name.
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

// The slowest renderer's.
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

// Of the first node, by name, that uses OpenGL.
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

json collisions(const StatusRegistry& statuses) {
  std::map<std::string, CollisionTotals> sums;
  for (const auto& [node, processes] : statuses.processes())
    for (const ProcessStatus& process : processes)
      for (const auto& [object, totals] : process.collisions) {
        sums[object].frames += totals.frames;
        sums[object].points += totals.points;
        sums[object].first_contacts += totals.first_contacts;
      }
  json by_object = json::object();
  for (const auto& [object, sum] : sums)
    by_object[object] = {
        {"frames", sum.frames}, {"points", sum.points}, {"first_contacts", sum.first_contacts}};
  return by_object;
}

json json_of_topics(const Processes& processes) {
  std::map<std::string, TopicTotals> sums;
  for (const ProcessStatus& process : processes)
    for (const auto& [topic, totals] : process.topics) {
      TopicTotals& sum = sums[topic];
      sum.sent += totals.sent;
      sum.not_sent += totals.not_sent;
      sum.received += totals.received;
      sum.recorded += totals.recorded;
      sum.lost += totals.lost;
    }
  json topics = json::object();
  for (const auto& [topic, sum] : sums)
    topics[topic] = {{"sent", sum.sent},
                     {"not_sent", sum.not_sent},
                     {"received", sum.received},
                     {"recorded", sum.recorded},
                     {"lost", sum.lost}};
  return topics;
}

double cpu_percent(const ProcessStatus& process, std::int64_t stop_stamp_ns) {
  const double uptime_s = 1e-9 * double(stop_stamp_ns - process.start_stamp_ns);
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
  node["cpu_percent"] = cpu_percent(last, stop_stamp_ns);  // of one core, of the newest process
  node["memory_mb"] = memory_mb;
  node["counts"] = summed(processes, &ProcessStatus::counts);
  node["topics"] = json_of_topics(processes);
  node["drops"] = summed(processes, &ProcessStatus::drops);
  node["latencies_ms"] = json::object();
  for (const auto& [name, latency] : busiest_latencies(processes))
    node["latencies_ms"][name] = json_of(latency);
  node["diagnostics"] = last.diagnostics;
  return node;
}

std::string text(const char* format, auto... values) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

std::string node_row(const std::string& name, const json& node) {
  if (!node.contains("cpu_s"))
    return text("  %-14s %-13s no status received; %s\n", name.c_str(),
                node["program"].get<std::string>().c_str(), node["end"].get<std::string>().c_str());
  std::uint64_t drops = 0;
  for (const auto& [reason, count] : node["drops"].items()) drops += count.get<std::uint64_t>();
  return text("  %-14s %-13s %7.0f %9.0f %8llu %9zu\n", name.c_str(),
              node["program"].get<std::string>().c_str(), node["cpu_percent"].get<double>(),
              node["memory_mb"].get<double>(), static_cast<unsigned long long>(drops),
              node["restarts"].size());
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
          ? 1e-9 * double(input.stop_stamp_ns - *input.first_composited_stamp_ns)
          : 0;

  std::map<std::string, std::uint64_t> dropped;
  for (const auto& [node, of_node] : processes)
    for (const auto& [reason, count] : summed(of_node, &ProcessStatus::drops))
      dropped[reason] += count;

  json nodes = json::object();
  for (const ProgramHistory& program : input.programs) {
    const auto of_node = processes.find(program.name);
    nodes[program.name] = json_of_node(
        program, of_node == processes.end() ? Processes{} : of_node->second, input.stop_stamp_ns);
  }
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
        {"dropped", dropped}}},
      {"frame_rate_hz",
       composited > 1 && composited_for_s > 0 ? double(composited - 1) / composited_for_s : 0.0},
      {"latency_ms", frame_latency(input.statuses)},
      {"collisions", collisions(input.statuses)},
      {"empty_cameras", empty_cameras(input.statuses)},
      {"duplicate_nodes", input.statuses.duplicates()},
      {"nodes", nodes}};
}

std::string table_of(const json& report) {
  const json& frames = report["frames"];
  std::string table = text(
      "%.1f s, %.1f frames/s composited; frames: %llu captured, %llu complete, %llu composited\n",
      report["duration_s"].get<double>(), report["frame_rate_hz"].get<double>(),
      frames["captured"].get<unsigned long long>(), frames["complete"].get<unsigned long long>(),
      frames["composited"].get<unsigned long long>());
  for (const auto& [reason, count] : frames["dropped"].items())
    table += "  dropped: " + std::to_string(count.get<std::uint64_t>()) + " " + reason + "\n";
  if (const json& latency = report["latency_ms"]; !latency.is_null())
    table += text("latency, capture to composite: p50 %.1f, p95 %.1f, p99 %.1f, max %.1f ms\n",
                  latency["p50"].get<double>(), latency["p95"].get<double>(),
                  latency["p99"].get<double>(), latency["max"].get<double>());
  for (const auto& [object, count] : report["collisions"].items())
    table += "collided: " + object + ", " + std::to_string(count["frames"].get<std::uint64_t>()) +
             " frames, " + std::to_string(count["points"].get<std::uint64_t>()) + " points\n";
  for (const json& camera : report["empty_cameras"])
    table += "hull empty: camera " + camera.get<std::string>() + " saw no object pixel\n";
  table += text("  %-14s %-13s %7s %9s %8s %9s\n", "node", "program", "CPU %", "memory MB", "drops",
                "restarts");
  for (const auto& [name, node] : report["nodes"].items()) {
    table += node_row(name, node);
    for (const json& restart : node["restarts"])
      table += "    restarted: " + restart["cause"].get<std::string>() + "\n";
  }
  return table;
}

}  // namespace fivepipe::launch
