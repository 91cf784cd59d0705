// `fivepipe bench pipeline --from FILE`: all nodes except capture_node, fed from a recording
// without loss, and the bus alone.
#pragma once
#include "benchmarks/nodes/from_recording.h"

namespace fivepipe::node_bench {

// Prints the latency by stage, CPU time and memory of each node, and, if bus_rounds > 0, the round
// trips of the bus beside ddsperf; writes the result file. Returns the exit code: 0; 1 if the times
// are not valid (a frame was missed or dropped); 130 after a signal. Throws
// recording::RecordingError if the deployment has no reconstruction or no rendering node, and what
// run_nodes() and time_bus() throw.
int bench_pipeline(const FromRecordingOptions& options, int bus_rounds);

}  // namespace fivepipe::node_bench
