#include "benchmarks/nodes/times_table.h"

#include "common/base/timing.h"

namespace fivepipe::node_bench {

base::TextTable times_table() {
  return base::TextTable(
      {{"ms", false, 0, 40}, {"mean", true}, {"median", true}, {"p95", true}, {"p99", true}});
}

void add_times(base::TextTable& table, const std::string& name,
               const std::vector<double>& time_ms) {
  std::vector<std::string> cells{name, base::with_decimals(base::mean(time_ms), 3)};
  for (const double p : {0.5, 0.95, 0.99})
    cells.push_back(base::with_decimals(base::percentile(time_ms, p), 3));
  table.add(std::move(cells));
}

}  // namespace fivepipe::node_bench
