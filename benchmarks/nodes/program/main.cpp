// fivepipe_measure: `fivepipe bench NODE`, `bench pipeline` and `bench compare`. A separate
// program, so that the demo does not build it.
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <functional>
#include <iostream>

#include "benchmarks/nodes/bus_ping.h"
#include "benchmarks/nodes/program/subcommands.h"
#include "common/base/usage_error.h"
#include "common/config/deployment.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::measure {
namespace {

// Returns 130 if `run` throws after a signal.
int interruptible(const std::function<int()>& run) {
  try {
    return run();
  } catch (const std::exception&) {
    if (launch::signals_received() > 0) return 130;
    throw;
  }
}

int run(const std::vector<std::string>& words) {
  if (words.empty()) throw base::UsageError("use `fivepipe bench`, which starts this program");
  const std::string& name = words.front();
  const std::vector<std::string> rest(words.begin() + 1, words.end());
  if (name == "compare") return bench_compare(rest);
  // `bench pipeline` starts this process.
  if (name == "bus-echo" && rest.size() == 1)
    return node_bench::echo_on_bus(std::uint32_t(std::stoul(rest[0])));
  return interruptible(
      [&] { return name == "pipeline" ? bench_pipeline(rest) : bench_node(name, rest); });
}

}  // namespace
}  // namespace fivepipe::measure

int main(int argc, char** argv) {
  using namespace fivepipe;
  spdlog::set_default_logger(spdlog::stderr_color_mt("fivepipe bench"));
  return base::report_errors([&] {
    try {
      return measure::run({argv + 1, argv + argc});
    } catch (const config::ConfigError& error) {
      throw base::UsageError(error.what());
    }
  });
}
