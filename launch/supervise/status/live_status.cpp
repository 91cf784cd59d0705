#include "launch/supervise/status/live_status.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "common/base/text_table.h"
#include "common/pipeline/node/status_names.h"
#include "launch/supervise/status/largest_counts.h"

namespace fivepipe::launch {
namespace {

// A peer can invent nodes, drops and diagnostics. `fivepipe top` shows at most this many, of one
// node or, kMaxShownMessages, of all nodes.
constexpr std::size_t kMaxShownNodes = 50, kMaxShownLines = 20, kMaxShownLatencies = 20,
                      kMaxShownMessages = 200;

using NodeStatuses = std::pair<std::string, std::vector<ProcessStatus>>;

// Returns all nodes by name, but those of a process that publishes many nodes last: it is a replay,
// or a peer that invents nodes.
std::vector<NodeStatuses> in_order_of_display(const StatusRegistry& registry) {
  const auto by_name = registry.processes();
  std::map<std::optional<bus::ProcessId>, std::size_t> nodes_of_process;
  for (const auto& [node, processes] : by_name) ++nodes_of_process[processes.back().process];
  std::vector<NodeStatuses> nodes(by_name.begin(), by_name.end());
  std::stable_sort(nodes.begin(), nodes.end(), [&](const NodeStatuses& a, const NodeStatuses& b) {
    return nodes_of_process[a.second.back().process] < nodes_of_process[b.second.back().process];
  });
  return nodes;
}

bool is_active(const NodeActivity& activity) {
  return !activity.ended && activity.silent_s <= kMaxSilence_s;
}

std::string state_of(const NodeActivity& activity) {
  if (is_active(activity)) return "running";
  return activity.ended ? "ended" : fmt::format("silent {:.0f} s", activity.silent_s);
}

// Returns the name of the host in the deployment; without one, the machine of the process.
std::string host_of(const ProcessStatus& status, const HostsOfNodes& deployed) {
  const auto found = deployed.find(status.node);
  if (found != deployed.end() && !found->second.empty()) return found->second;
  return status.process ? base::printable(status.process->host) : "-";
}

std::string silence_text(const std::string& node, double silent_s, const Progress& progress) {
  const auto other = progress.other_hosts.find(node);
  if (other == progress.other_hosts.end())
    return fmt::format("{}: no status for {:.0f} s", node, silent_s);
  return fmt::format("{}: out of reach, no status from {} for {:.0f} s", node,
                     other->second.empty() ? "another host" : "host " + other->second, silent_s);
}

std::string latency_text(const ProcessStatus& status) {
  std::vector<std::string> parts;
  for (const auto& [name, latency] : status.latencies) {
    if (parts.size() == kMaxShownLatencies) break;
    parts.push_back(
        fmt::format("{} {:.1f}/{:.1f}", base::printable(name), latency.p50_ms, latency.p99_ms));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

// Of the slowest render_node; 0 if one of them is silent.
double frame_rate_hz(const std::vector<std::string>& render_nodes, const StatusRegistry& registry,
                     std::int64_t now_ns) {
  double slowest_hz = std::numeric_limits<double>::infinity();
  for (const std::string& node : render_nodes) {
    const auto activity = registry.activity(node, now_ns);
    const bool active = activity && is_active(*activity);
    slowest_hz = std::min(slowest_hz, active ? registry.newest(node)->frame_rate_hz : 0);
  }
  return slowest_hz;
}

std::string rendering_text(const Progress& progress, const StatusRegistry& registry,
                           std::int64_t now_ns) {
  if (progress.render_nodes.empty()) return "no render_node";
  if (!progress.newest_frame_age_s) return "no frame composited yet";
  const std::string composited = base::counted(progress.composited, "frame") + " composited, ";
  if (*progress.newest_frame_age_s > max_frame_gap_s(progress.frame_rate_hz))
    return composited + fmt::format("no frame for {:.0f} s", *progress.newest_frame_age_s);
  return composited +
         fmt::format("now {:.1f} frames/s", frame_rate_hz(progress.render_nodes, registry, now_ns));
}

}  // namespace

double max_frame_gap_s(double frame_rate_hz) { return std::max(2.0, 3 / frame_rate_hz); }

std::string progress_line(const Progress& progress, const StatusRegistry& registry,
                          std::int64_t now_ns) {
  std::string line =
      fmt::format("{:.0f} s: ", progress.elapsed_s) + rendering_text(progress, registry, now_ns);
  for (const std::string& host : progress.missing_hosts) line += "; " + host;
  for (const std::string& node : progress.expected) {
    const auto activity = registry.activity(node, now_ns);
    if (!activity)
      line += fmt::format("; {}: no status yet", node);
    else if (!activity->ended && activity->silent_s > kMaxSilence_s)
      line += "; " + silence_text(node, activity->silent_s, progress);
  }
  return line;
}

std::string nodes_table(const StatusRegistry& registry, std::int64_t now_ns,
                        const HostsOfNodes& deployed) {
  base::TextTable table({{.head = "node", .min_width = 14},
                         {.head = "host", .min_width = 8},
                         {.head = "state", .min_width = 12},
                         {.head = "frame", .right = true, .min_width = 8},
                         {.head = "Hz", .right = true, .min_width = 6},
                         {.head = "CPU %", .right = true, .min_width = 6},
                         {.head = "memory MB", .right = true, .min_width = 9},
                         {.head = "drops", .right = true, .min_width = 7},
                         {.head = "latencies p50/p99 ms"}});
  for (const auto& [node, host] : deployed)
    if (!registry.newest(node))
      table.add({node, host.empty() ? "-" : host, "no status", "-", "-", "-", "-", "-", ""});
  std::size_t shown = 0;
  const auto nodes = in_order_of_display(registry);
  for (const auto& [node, processes] : nodes) {
    if (++shown > kMaxShownNodes) break;
    const ProcessStatus& status = processes.back();
    const NodeActivity activity = registry.activity(node, now_ns).value();
    std::uint64_t drops = 0;
    for (const auto& [text, count] : status.drops) drops += count;
    // The rates of a silent node are those before its silence.
    const bool active = is_active(activity);
    table.add(
        {base::printable(node), host_of(status, deployed), state_of(activity),
         std::to_string(status.frame), active ? base::with_decimals(status.frame_rate_hz, 1) : "-",
         active ? base::with_decimals(registry.cpu_percent(node), 0) : "-",
         base::with_decimals(status.memory_mb, 0), std::to_string(drops), latency_text(status)});
  }
  const std::size_t more = nodes.size() - std::min(nodes.size(), kMaxShownNodes);
  return table.text() + (more == 0 ? "" : "and " + base::counted(more, "more node") + "\n");
}

std::string node_messages(const StatusRegistry& registry) {
  std::vector<std::string> lines;
  for (const auto& [node, processes] : in_order_of_display(registry)) {
    const ProcessStatus& status = processes.back();
    for (const auto& [name, count] : largest(refused_from(status.counts), kMaxShownLines))
      lines.push_back(fmt::format("{}: refused {} messages from {}", node, count, name));
    for (const auto& [text, count] : largest(status.drops, kMaxShownLines))
      lines.push_back(fmt::format("{}: dropped {}: {}", node, count, text));
    for (std::size_t i = 0; i < std::min(status.diagnostics.size(), kMaxShownLines); ++i)
      lines.push_back(fmt::format("{}: {}", node, status.diagnostics[i]));
  }
  std::string shown;
  for (std::size_t i = 0; i < std::min(lines.size(), kMaxShownMessages); ++i)
    shown += base::printable(lines[i]) + "\n";
  if (lines.size() > kMaxShownMessages)
    shown += fmt::format("and {} more lines\n", lines.size() - kMaxShownMessages);
  const std::vector<DuplicateNode> duplicates = registry.duplicates();
  for (std::size_t i = 0; i < std::min(duplicates.size(), kMaxShownLines); ++i)
    shown += text_of(duplicates[i]) + "\n";
  if (registry.ignored() > 0)
    shown += fmt::format("ignored {}: too many nodes, or an impossible start of the process\n",
                         base::counted(registry.ignored(), "status message"));
  return shown;
}

std::string text_of(const DuplicateNode& duplicate) {
  return base::printable(fmt::format("{} processes publish as node '{}': {}",
                                     duplicate.processes.size(), duplicate.node,
                                     fmt::join(duplicate.processes, ", ")));
}

}  // namespace fivepipe::launch
