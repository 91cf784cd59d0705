// Describes the machine in reports.
#pragma once
#include <string>

namespace fivepipe::base {

std::string cpu_name();   // "unknown" if /proc/cpuinfo has no model name
int core_count();         // cores that this process may run on; at least 1
std::string host_name();  // as gethostname() returns it

}  // namespace fivepipe::base
