// Particles on a real block that a real arm crosses at 1 m/s.
#pragma once
#include <string>

#include "benchmarks/sim/sim_run.h"

namespace fivepipe::sim_bench {

// block: all particles fall on the block, and most touch it in each step. wide: five eighths fall
// beside it, on a virtual table.
enum class Rain { block, wide };

// Returns the name of the result.
std::string particles_name(int count, Rain rain_on);
// Measures the simulation of `count` particles. is_quick: 10 frames instead of 60.
Result swept_particles(int count, Rain rain_on, int threads, bool is_quick);

}  // namespace fivepipe::sim_bench
