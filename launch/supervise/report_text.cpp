// The report as text for people.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/text_table.h"
#include "common/pipeline/node/status_names.h"
#include "launch/supervise/report.h"
#include "launch/supervise/status/largest_counts.h"

namespace fivepipe::launch {
namespace {

using nlohmann::json;

std::string recorder_line(const json& recorder) {
  if (recorder.is_null() || recorder["complete"].get<bool>()) return "";
  const json& ended_after_s = recorder["ended_after_s"];
  return fmt::format(
      "the recording is incomplete: {}; {} of {} received messages recorded; end of the "
      "recorder{}: {}\n",
      recorder["file"].get<std::string>(), recorder["recorded"].get<std::uint64_t>(),
      recorder["received"].get<std::uint64_t>(),
      ended_after_s.is_null() ? "" : fmt::format(" after {:.1f} s", ended_after_s.get<double>()),
      recorder["end"].get<std::string>());
}

std::string frames_line(const json& report) {
  const json& frames = report["frames"];
  return fmt::format(
      "{:.1f} s, {:.1f} frames/s composited; frames: {} captured, {} complete, {} composited\n",
      report["duration_s"].get<double>(), report["frame_rate_hz"].get<double>(),
      frames["captured"].get<std::uint64_t>(), frames["complete"].get<std::uint64_t>(),
      frames["composited"].get<std::uint64_t>());
}

std::string latency_line(const json& report) {
  const json& latency = report["latency_ms"];
  if (latency.is_null()) {
    const std::string name = std::string(node::kCaptureToComposite) + node::kNotCompared;
    for (const json& node : report["nodes"])
      if (node.value("latencies_ms", json::object()).contains(name))
        return "latency, capture to composite: unknown, as the clocks of the hosts were not "
               "compared\n";
    return "";
  }
  return fmt::format(
      "latency, capture to composite: p50 {:.1f}, p95 {:.1f}, p99 {:.1f}, max {:.1f} ms\n",
      latency["p50"].get<double>(), latency["p95"].get<double>(), latency["p99"].get<double>(),
      latency["max"].get<double>());
}

std::string work_lines(const json& report) {
  const json& work = report["core_ms_per_set"];
  if (work.is_null()) return "";
  std::string parts;
  for (const auto& [part, ms] : work.items())
    if (part != "sum")
      parts += fmt::format("{}{} {:.1f}", parts.empty() ? "" : ", ", part, ms.get<double>());
  const std::string bound = report["rate_bound"];
  return fmt::format("processor time per set: {:.1f} core-ms ({})\n", work["sum"].get<double>(),
                     parts) +
         (bound.empty() ? "" : fmt::format("the rate is bound by {}\n", bound));
}

// Returns one line per element of `elements`, at most kMaxShownCounts, and one about the remaining
// ones.
template <class LineOf>
std::string lines_of(const json& elements, const char* heading, const LineOf& line_of) {
  std::string lines;
  std::size_t shown = 0;
  for (const auto& [key, element] : elements.items()) {
    if (shown == kMaxShownCounts) break;
    lines += fmt::format("{}: {}\n", heading, base::printable(line_of(key, element)));
    ++shown;
  }
  return elements.size() == shown
             ? lines
             : lines + fmt::format("{}: {} more\n", heading, elements.size() - shown);
}

// Other processes state the names of objects and cameras, and the texts of drops.
std::string events_of(const json& report) {
  std::string lines;
  for (const auto& [reason, count] : report["frames"]["dropped"].items())
    lines += fmt::format("  dropped: {} {}\n", count.get<std::uint64_t>(), base::printable(reason));
  for (const auto& [process, count] : report["refused_from"].items())
    lines += fmt::format("  refused: {} messages from {}\n", count.get<std::uint64_t>(),
                         base::printable(process));
  return lines + latency_line(report) +
         lines_of(report["collisions"], "collided",
                  [](const std::string& object, const json& count) {
                    return fmt::format(
                        "{}, {}, {}", object,
                        base::counted(count["frames"].get<std::uint64_t>(), "frame"),
                        base::counted(count["points"].get<std::uint64_t>(), "point"));
                  }) +
         lines_of(report["empty_cameras"], "hull empty", [](const auto&, const json& camera) {
           return fmt::format("camera {} saw no object pixel", camera.get<std::string>());
         });
}

std::string nodes_table(const json& nodes) {
  base::TextTable table({{.head = "node"},
                         {.head = "program"},
                         {.head = "CPU %", .right = true},
                         {.head = "memory MB", .right = true},
                         {.head = "drops", .right = true},
                         {.head = "restarts", .right = true},
                         {.head = "note"}});
  for (const auto& [name, node] : nodes.items()) {
    const std::string program = node["program"], end = node["end"];
    if (!node.contains("cpu_s")) {
      table.add({name, program, "-", "-", "-", "-", "no status received; " + end});
      continue;
    }
    std::uint64_t drops = 0;
    for (const auto& [reason, count] : node["drops"].items()) drops += count.get<std::uint64_t>();
    table.add({name, program, base::with_decimals(node["cpu_percent"], 0),
               base::with_decimals(node["memory_mb"], 0), std::to_string(drops),
               std::to_string(node["restarts"].size()), ""});
  }
  std::string text = table.text();
  for (const auto& [name, node] : nodes.items())
    for (const json& restart : node["restarts"])
      text += fmt::format("restarted: {}, {}\n", name, restart["cause"].get<std::string>());
  return text;
}

std::string clock_lines(const json& hosts) {
  std::string lines;
  for (const auto& [name, host] : hosts.items()) {
    const std::string shown = base::printable(name);
    if (host["clock_offset_ms"].is_null()) {
      lines += fmt::format("clock of host {}: not compared with that of this host\n", shown);
      continue;
    }
    const ClockOffset offset{std::llround(1e6 * host["clock_offset_ms"].get<double>()),
                             std::llround(1e6 * host["clock_error_ms"].get<double>())};
    if (verdict_on(offset) != ClockVerdict::good)
      lines += fmt::format("clock of host {}: {}\n", shown, text_of(offset));
  }
  return lines;
}

}  // namespace

std::string table_of(const json& report) {
  return frames_line(report) + work_lines(report) + events_of(report) +
         recorder_line(report["recorder"]) + nodes_table(report["nodes"]) +
         clock_lines(report["hosts"]);
}

}  // namespace fivepipe::launch
