#include "launch/benchmark/times_table.h"

#include <cstdio>

#include "common/bench/timing.h"

namespace fivepipe {

void print_times_header() { std::printf("  %-44s %9s %9s %9s %9s\n", "ms", "mean", "median", "p95", "p99"); }

void print_times(const std::string& name, const std::vector<double>& time_ms) {
  using bench::percentile;
  std::printf("  %-44s %9.3f %9.3f %9.3f %9.3f\n", name.c_str(), bench::mean(time_ms), percentile(time_ms, 0.5), percentile(time_ms, 0.95), percentile(time_ms, 0.99));
}

}  // namespace fivepipe
