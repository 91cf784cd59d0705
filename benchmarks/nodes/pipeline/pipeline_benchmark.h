// `fivepipe bench pipeline`: all nodes of a deployment. A recording replaces capture_node, or
// capture_node runs with the sources of the deployment.
#pragma once
#include "benchmarks/nodes/from_recording.h"

namespace fivepipe::node_bench {

// Prints the latency by stage, its check from outside the nodes, and CPU time and memory of each
// node; writes the result file. Returns the exit code: 0; 1 if the times are not valid (a frame was
// missed or dropped, or none was composited); 130 after a signal. Throws recording::RecordingError
// if the deployment has no reconstruction or no rendering node.

// Nodes except capture_node, fed from options.recording without loss. If bus_rounds > 0, also the
// round trips of the bus beside ddsperf. Also throws what run_nodes() and time_bus() throw.
int bench_replayed_pipeline(const FromRecordingOptions& options, int bus_rounds);

// All nodes of options.deployment, for duration_s. Also throws what run_live() throws, and
// recording::RecordingError if the deployment has no capture_node.
int bench_live_pipeline(const FromRecordingOptions& options, double duration_s);

}  // namespace fivepipe::node_bench
