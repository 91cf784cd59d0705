// `fivepipe bench NODE --from FILE`: one node alone, fed from a recording without loss.
#pragma once
#include <string>

#include "benchmarks/nodes/from_recording.h"

namespace fivepipe::node_bench {

// Runs the node `options.runs` times and prints the time of each step, the share of the transport,
// CPU time, memory and the checksums of its output; writes the result file. `name` is a node's name
// or a program, which selects the first node that runs it. Returns the exit code: 0; 1 if the times
// are not valid (a frame was missed or dropped, or the output differs between runs); 2 for
// capture_node, which has no recorded input; 130 after a signal. Throws base::UsageError if the
// deployment has no such node, and what run_nodes() throws.
int bench_node(const std::string& name, const FromRecordingOptions& options, bool checksums);

}  // namespace fivepipe::node_bench
