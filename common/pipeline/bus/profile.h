// Network profiles: Cyclone DDS configuration, shipped in launch/profiles and compiled in.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace fivepipe::bus {

// Names of the shipped profiles.
std::vector<std::string> profile_names();

// XML of a shipped profile, or of CYCLONEDDS_URI where that is set (file://PATH or the XML itself).
// Throws BusError naming the profiles there are, or the file that can't be read.
std::string profile_xml(const std::string& name);

// The profile with its receive buffer's minimum lowered to what the kernel grants, so that a
// participant can be made at all; warning says what to set where it was lowered, and is empty
// otherwise.
struct FittedProfile {
  std::string xml, warning;
};
FittedProfile fitted_to_kernel(const std::string& xml, std::size_t rmem_max_bytes);

// net.core.rmem_max; 0 where it can't be read.
std::size_t kernel_rmem_max_bytes();

}  // namespace fivepipe::bus
