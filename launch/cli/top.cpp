#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>
#include <thread>

#include "common/base/realtime.h"
#include "common/base/text_table.h"
#include "launch/cli/commands.h"
#include "launch/cli/options.h"
#include "launch/supervise/status_messages.h"

namespace fivepipe::launch {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kRefreshPeriod = 1s;
// Discovery takes up to 1 s, and nodes publish twice per second.
constexpr auto kListeningTime = 2500ms;
constexpr std::int64_t kSilenceTimeout_ns = 2'000'000'000;

struct TopOptions {
  NetworkOptions network;
  bool once = false;
};

std::string latency_text(const ProcessStatus& status) {
  std::vector<std::string> parts;
  for (const auto& [name, latency] : status.latencies)
    parts.push_back(fmt::format("{} {:.1f}/{:.1f}", name, latency.p50_ms, latency.p99_ms));
  return fmt::format("{}", fmt::join(parts, ", "));
}

const char* state_of(const ProcessStatus& status, bool alive) {
  if (alive) return "";
  return status.final_report ? "ended" : "silent";
}

std::string nodes_table(const StatusRegistry& registry) {
  const std::vector<std::string> alive =
      registry.alive(base::now_realtime_ns(), kSilenceTimeout_ns);
  base::TextTable table({{.head = "node", .min_width = 14},
                         {.head = "state", .min_width = 6},
                         {.head = "frame", .right = true, .min_width = 8},
                         {.head = "Hz", .right = true, .min_width = 6},
                         {.head = "CPU %", .right = true, .min_width = 6},
                         {.head = "memory MB", .right = true, .min_width = 9},
                         {.head = "drops", .right = true, .min_width = 7},
                         {.head = "latencies p50/p99 ms"}});
  for (const auto& [node, processes] : registry.processes()) {
    const ProcessStatus& status = processes.back();
    std::uint64_t drops = 0;
    for (const auto& [text, count] : status.drops) drops += count;
    const bool is_alive = std::find(alive.begin(), alive.end(), node) != alive.end();
    table.add({status.node, state_of(status, is_alive), std::to_string(status.frame),
               base::with_decimals(status.frame_rate_hz, 1),
               base::with_decimals(registry.cpu_percent(node), 0),
               base::with_decimals(status.memory_mb, 0), std::to_string(drops),
               latency_text(status)});
  }
  return table.text();
}

std::string messages_of(const StatusRegistry& registry) {
  std::string lines;
  for (const auto& [node, processes] : registry.processes()) {
    for (const auto& [text, count] : processes.back().drops)
      lines += fmt::format("{}: dropped {}: {}\n", node, count, base::printable(text));
    for (const std::string& diagnostic : processes.back().diagnostics)
      lines += fmt::format("{}: {}\n", node, base::printable(diagnostic));
  }
  for (const std::string& node : registry.duplicates())
    lines += fmt::format("two processes publish as node '{}'\n", node);
  return lines;
}

int run_top(const TopOptions& options) {
  bus::Bus bus({options.network.domain, options.network.profile});
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
    const bool is_silent = registry.processes().empty();
    if (on_terminal) std::cout << "\x1b[H\x1b[2J";  // cursor to the top left corner, clear
    if (is_silent)
      std::cout << "no node publishes a status in domain " << options.network.domain << "\n";
    else
      std::cout << nodes_table(registry) << messages_of(registry) << (on_terminal ? "" : "\n");
    std::cout << std::flush;
    if (options.once) return is_silent ? 3 : 0;
    if (!std::cout) return 1;  // the reader of the pipe is gone
  }
}

}  // namespace

void add_top(CLI::App& app, Command& command) {
  auto options = std::make_shared<TopOptions>();
  CLI::App* top = app.add_subcommand(
      "top", "Show the running nodes and refresh the table each second until Ctrl-C");
  top->footer(
      "Examples:\n  fivepipe top\n  fivepipe top --domain 7 --once\n\n"
      "Exit codes with --once: 0 done, 3 no node publishes a status.");
  add_network_options(top, options->network);
  top->add_flag("--once", options->once, "print one table and end");
  top->callback([options, &command] { command = [options] { return run_top(*options); }; });
}

}  // namespace fivepipe::launch
