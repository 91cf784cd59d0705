#include "benchmarks/nodes/times_table.h"

#include <cstdio>

#include "common/base/timing.h"

namespace fivepipe::node_bench {

void print_times_header() {
  std::printf("  %-44s %9s %9s %9s %9s\n", "ms", "mean", "median", "p95", "p99");
}

void print_times(const std::string& name, const std::vector<double>& time_ms) {
  using base::percentile;
  std::printf("  %-44s %9.3f %9.3f %9.3f %9.3f\n", name.c_str(), base::mean(time_ms),
              base::percentile(time_ms, 0.5), base::percentile(time_ms, 0.95),
              base::percentile(time_ms, 0.99));
}

}  // namespace fivepipe::node_bench
