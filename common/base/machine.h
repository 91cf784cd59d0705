// Describes the machine in reports.
#pragma once
#include <string>

namespace fivepipe::base {

// Returns the model and, on x86, the widest vector extension, such as "AMD EPYC (AVX2)": models
// with one name may have different ones. "unknown" if /proc/cpuinfo has no model name.
std::string cpu_name();
int core_count();         // cores that this process may run on; at least 1
std::string host_name();  // as gethostname() returns it

}  // namespace fivepipe::base
