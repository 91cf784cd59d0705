// The machine in words, for reports.
#pragma once
#include <string>

namespace fivepipe::base {

std::string cpu_name();  // "unknown" where /proc/cpuinfo doesn't say
int core_count();        // that this process may run on
std::string host_name();

}  // namespace fivepipe::base
