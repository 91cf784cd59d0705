// How benchmark suites time: methods in turn within one process, so that the machine's mood meets
// all alike.
#pragma once
#include <functional>
#include <vector>

namespace fivepipe::base {

double percentile(std::vector<double> values, double p);  // p in 0..1; 0 of none
double mean(const std::vector<double>& values);

// A method is timed so often, or until it has taken so long, but so often at least.
struct Budget {
  int runs, min_runs;
  double s;
};

// run(method, counted) gives the milliseconds that it took. The first round, not counted, warms up;
// nobody always runs after the same other.
void time_round_robin(std::size_t methods, const Budget& budget,
                      const std::function<double(std::size_t method, bool counted)>& run);

}  // namespace fivepipe::base
