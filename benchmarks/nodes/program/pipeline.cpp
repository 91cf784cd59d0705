#include "benchmarks/nodes/pipeline_benchmark.h"
#include "benchmarks/nodes/program/options.h"
#include "benchmarks/nodes/program/subcommands.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::measure {

int bench_pipeline(const std::vector<std::string>& words) {
  bool without_bus = false;
  int bus_rounds = 2;
  CLI::App app(
      "Measure all nodes except capture_node. A recording feeds them without loss; the output "
      "lists the frame rate, the latency by stage, and the bus alone beside ddsperf.\n\nExamples:\n"
      "  fivepipe bench pipeline --from session.mcap\n"
      "  fivepipe bench pipeline --from session.mcap --in-flight 1 --no-bus --json "
      "out/pipeline.json\n\n"
      "Exit codes: 0; 1 if a frame was not handled, or an input was dropped or not recorded; 2 for "
      "wrong arguments; 130 interrupted.",
      "fivepipe bench pipeline");
  BenchOptions options(app);
  app.add_flag("--no-bus", without_bus, "do not measure the bus alone");
  app.add_option("--bus-rounds", bus_rounds, "measure the bus and ddsperf alternately, this often")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  if (const auto exit_code = parse(app, words)) return *exit_code;
  launch::catch_signals();
  return node_bench::bench_pipeline(options.values(), without_bus ? 0 : bus_rounds);
}

}  // namespace fivepipe::measure
