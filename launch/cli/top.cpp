#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <thread>

#include "launch/cli/commands.h"
#include "launch/supervise/status_messages.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kRefreshPeriod = 1s;
// Nodes publish twice a second, and a participant is discovered within a second.
constexpr auto kListeningTime = 2500ms;
constexpr std::int64_t kSilenceTimeout_ns = 2'000'000'000;

struct TopOptions {
  std::uint32_t domain = 0;
  std::string profile = "loopback";
  bool once = false;
};

std::string latency_text(const ProcessStatus& status) {
  std::string text;
  for (const auto& [name, latency] : status.latencies) {
    char part[128];
    std::snprintf(part, sizeof part, "%s%s %.1f/%.1f", text.empty() ? "" : ", ", name.c_str(),
                  latency.p50_ms, latency.p99_ms);
    text += part;
  }
  return text;
}

std::string row(const ProcessStatus& status, double cpu_percent, bool alive) {
  std::uint64_t drops = 0;
  for (const auto& [reason, count] : status.drops) drops += count;
  char text[160];
  std::snprintf(text, sizeof text, "%-14s %8llu %6.1f %6.0f %9.0f %7llu  ", status.node.c_str(),
                static_cast<unsigned long long>(status.frame), status.frame_rate_hz, cpu_percent,
                status.memory_mb, static_cast<unsigned long long>(drops));
  std::string lines = text + latency_text(status) +
                      (alive                 ? ""
                       : status.final_report ? "  (ended)"
                                             : "  (silent)") +
                      "\n";
  for (const auto& [reason, count] : status.drops)
    lines += "    dropped " + std::to_string(count) + ": " + reason + "\n";
  for (const std::string& diagnostic : status.diagnostics) lines += "    " + diagnostic + "\n";
  return lines;
}

std::string table_of(const StatusRegistry& registry) {
  const std::int64_t now_ns = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                  std::chrono::system_clock::now().time_since_epoch())
                                  .count();
  const std::vector<std::string> alive = registry.alive(now_ns, kSilenceTimeout_ns);
  char head[160];
  std::snprintf(head, sizeof head, "%-14s %8s %6s %6s %9s %7s  %s\n", "node", "frame", "Hz",
                "CPU %", "memory MB", "drops", "latencies p50/p99 ms");
  std::string table = head;
  for (const auto& [node, processes] : registry.processes())
    table += row(processes.back(), registry.cpu_percent(node),
                 std::find(alive.begin(), alive.end(), node) != alive.end());
  for (const std::string& node : registry.duplicates())
    table += "two processes publish as node '" + node + "'\n";
  return table;
}

int run_top(const TopOptions& options) {
  bus::Bus bus({options.domain, options.profile});
  auto statuses_in = bus.reader<bus::topics::NodeStatus>();
  StatusRegistry registry;
  const bool on_terminal = isatty(STDOUT_FILENO) && !options.once;
  for (auto next = Clock::now() + (options.once ? Clock::duration(kListeningTime)
                                                : Clock::duration(kRefreshPeriod));
       ; next += kRefreshPeriod) {
    while (Clock::now() < next) {
      if (bus.wait(std::chrono::ceil<std::chrono::milliseconds>(next - Clock::now())))
        take_statuses(statuses_in, registry);
    }
    const bool nobody = registry.processes().empty();
    if (on_terminal) std::cout << "\x1b[H\x1b[2J";  // home, clear
    if (nobody)
      std::cout << "no node heard in domain " << options.domain << "\n";
    else
      std::cout << table_of(registry) << (on_terminal ? "" : "\n");
    std::cout << std::flush;
    if (options.once) return nobody ? 3 : 0;
    if (!std::cout) return 1;  // whoever read us has gone
  }
}

}  // namespace

void add_top(CLI::App& app, Command& command) {
  auto options = std::make_shared<TopOptions>();
  CLI::App* top =
      app.add_subcommand("top", "Show the running nodes, refreshed each second; Ctrl-C ends it");
  top->footer(
      "Examples:\n  fivepipe top\n  fivepipe top --domain 7 --once\n\nWith --once: exit code 3 "
      "where no node was heard.");
  top->add_option("--domain", options->domain, "DDS domain")
      ->check(CLI::Range(0, 230))
      ->capture_default_str();
  top->add_option("--profile", options->profile,
                  "network profile; CYCLONEDDS_URI in the environment wins")
      ->capture_default_str();
  top->add_flag("--once", options->once, "one table, then end");
  top->callback([options, &command] { command = [options] { return run_top(*options); }; });
}

}  // namespace fivepipe::launch
