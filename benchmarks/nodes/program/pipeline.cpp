#include "benchmarks/nodes/pipeline/pipeline_benchmark.h"
#include "benchmarks/nodes/program/options.h"
#include "benchmarks/nodes/program/subcommands.h"
#include "common/base/usage_error.h"
#include "launch/supervise/interrupt.h"

namespace fivepipe::measure {

int bench_pipeline(const std::vector<std::string>& words) {
  bool without_bus = false;
  int bus_rounds = 2;
  double duration_s = 10;
  CLI::App app(
      "Measure the pipeline: the frame rate, the latency by stage, and CPU time and memory of each "
      "node. The messages on the loopback interface check each stage from outside the nodes (needs "
      "CAP_NET_RAW).\n"
      "With --from, a recording replaces capture_node and feeds the other nodes without loss; the "
      "output also lists the bus alone beside ddsperf. Without --from, all nodes of --deployment "
      "run, capture_node included.\n\nExamples:\n"
      "  fivepipe bench pipeline --from session.mcap\n"
      "  fivepipe bench pipeline --from session.mcap --in-flight 1 --no-bus --json "
      "out/pipeline.json\n"
      "  fivepipe bench pipeline --deployment launch/deployments/demo.yaml --duration 20\n\n"
      "Exit codes: 0; 1 if a frame was not handled, an input was dropped or not recorded, or no "
      "frame was composited; 2 for wrong arguments; 130 interrupted.",
      "fivepipe bench pipeline");
  BenchOptions options(app, false);
  app.add_flag("--no-bus", without_bus, "do not measure the bus alone");
  app.add_option("--bus-rounds", bus_rounds, "measure the bus and ddsperf alternately, this often")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  app.add_option("--duration", duration_s, "without --from: measure this many seconds")
      ->check(CLI::Range(1.0, 3600.0))
      ->capture_default_str()
      ->excludes("--from");
  if (const auto exit_code = parse(app, words)) return *exit_code;
  const node_bench::FromRecordingOptions values = options.values();
  if (values.recording.empty() && values.deployment.empty())
    throw base::UsageError(
        "bench pipeline: name a recording (--from) or a deployment "
        "(--deployment)");
  launch::catch_signals();
  return values.recording.empty()
             ? node_bench::bench_live_pipeline(values, duration_s)
             : node_bench::bench_replayed_pipeline(values, without_bus ? 0 : bus_rounds);
}

}  // namespace fivepipe::measure
