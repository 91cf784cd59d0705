// CPU time of processes.
#pragma once
#include <sys/resource.h>
#include <sys/types.h>
#include <time.h>

#include <cerrno>
#include <system_error>

#include "tests/support/sanitizer.h"

namespace fivepipe::test {

// User and system time of the process so far, of all its threads. Throws std::system_error if there
// is no such process.
inline double cpu_s(pid_t pid) {
  clockid_t clock{};
  timespec time{};
  int error = clock_getcpuclockid(pid, &clock);
  if (error == 0 && clock_gettime(clock, &time) != 0) error = errno;
  if (error != 0) throw std::system_error(error, std::generic_category(), "CPU time of a process");
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

// CPU time of all ended children of this process.
inline double children_cpu_s() {
  rusage used{};
  getrusage(RUSAGE_CHILDREN, &used);
  return double(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         1e-6 * double(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

// Maximum CPU time of a program that waits, per elapsed time. One that sleeps uses about 1 % of a
// core, under a sanitizer at most kSlowdown times as much. A busy loop uses at least 24 %, even if
// all cores are loaded.
inline constexpr double kMaxWaitingShare = kHasSanitizer ? 0.2 : 0.1;

}  // namespace fivepipe::test
