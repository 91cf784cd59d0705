// Particles on a real block that a real arm crosses at 1 m/s.
#pragma once
#include "benchmarks/sim/sim_run.h"

namespace fivepipe::sim_bench {

// The result's name is "particles/<count>".
Result swept_particles(int count, int threads, bool is_quick);

}  // namespace fivepipe::sim_bench
