#include "common/base/timing.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace fivepipe::base {

double percentile(std::vector<double> values, double p) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         std::size_t(std::ceil(p * double(values.size()))) - (p > 0))];
}

double mean(const std::vector<double>& values) {
  return values.empty()
             ? 0
             : std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double thread_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

double process_cpu_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

void time_round_robin(std::size_t methods, const Budget& budget,
                      const std::function<double(std::size_t, bool)>& run) {
  std::vector<double> spent_s(methods);
  for (int round = -1; round < budget.runs; ++round)
    for (std::size_t n = 0; n < methods; ++n) {
      const std::size_t m = (n + std::size_t(round + 1)) % methods;
      if (round >= budget.min_runs && spent_s[m] > budget.s) continue;
      const double ms = run(m, round >= 0);
      if (round >= 0) spent_s[m] += 1e-3 * ms;
    }
}

}  // namespace fivepipe::base
