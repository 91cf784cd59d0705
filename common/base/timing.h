// Time measurement. The methods of a benchmark run round-robin in one process, so that changes of
// the machine's clock rate and load affect all of them equally.
#pragma once
#include <chrono>
#include <functional>
#include <vector>

namespace fivepipe::base {

// The smallest value that at least the fraction p (0..1) of the values does not exceed (nearest
// rank). Returns 0 if there are no values.
double percentile(std::vector<double> values, double p);
double mean(const std::vector<double>& values);  // 0 if there are no values

double seconds_since(std::chrono::steady_clock::time_point start);
// User and system time of the calling thread, and of all threads of the process, since their start
// [s].
double thread_cpu_s();
double process_cpu_s();

// A method runs at most `runs` times. It stops earlier once its runs have taken more than `s`
// seconds, but not before `min_runs`.
struct Budget {
  int runs, min_runs;
  double s;
};

// Calls run(method, counted), which returns its duration in milliseconds, round-robin. The first
// round warms up and has counted == false. Each round starts with another method, so that no method
// always follows the same one.
void time_round_robin(std::size_t methods, const Budget& budget,
                      const std::function<double(std::size_t method, bool counted)>& run);

}  // namespace fivepipe::base
