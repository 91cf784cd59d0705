// Network profiles: Cyclone DDS configurations from launch/profiles, compiled into the programs.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

namespace fivepipe::bus {

// Returns the names of the shipped profiles.
std::vector<std::string> profile_names();

// Returns the XML of a shipped profile, or of CYCLONEDDS_URI (file://PATH or XML) if that is set.
// Throws BusError for an unknown name, with the known names, and for an unreadable file.
std::string profile_xml(const std::string& name);

// Lowers the profile's minimum receive buffer to the size that the kernel grants, because Cyclone
// DDS creates no participant otherwise. `warning` names the setting to change; it is empty if the
// profile is unchanged.
struct FittedProfile {
  std::string xml, warning;
};
FittedProfile fitted_to_kernel(const std::string& xml, std::size_t rmem_max_bytes);

// Returns net.core.rmem_max, or 0 if it cannot be read.
std::size_t kernel_rmem_max_bytes();

}  // namespace fivepipe::bus
