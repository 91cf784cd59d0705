#include "benchmarks/nodes/node_benchmark.h"
#include "benchmarks/nodes/program/options.h"
#include "benchmarks/nodes/program/subcommands.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::measure {

int bench_node(const std::string& node, const std::vector<std::string>& words) {
  bool without_checksum = false;
  CLI::App app(
      "Measure one node alone. A recording feeds it without loss; the output lists the time of "
      "each step, the transport, CPU, memory and the checksums of the node's output.\n\nExamples:\n"
      "  fivepipe bench recon_node --from session.mcap\n"
      "  fivepipe bench simulation --from session.mcap --json out/simulation.json --runs 5\n\n"
      "Exit codes: 0; 1 if a frame was not handled, an input was dropped or not recorded, or the "
      "output differs between runs; 2 for wrong arguments or capture_node; 130 interrupted.",
      "fivepipe bench " + node);
  BenchOptions options(app, true);
  app.add_flag("--no-checksum", without_checksum, "do not read the node's output");
  if (const auto exit_code = parse(app, words)) return *exit_code;
  launch::catch_signals();
  return node_bench::bench_node(node, options.values(), !without_checksum);
}

}  // namespace fivepipe::measure
