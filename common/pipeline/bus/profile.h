// Network profiles: Cyclone DDS configurations from launch/profiles, compiled into the programs.
#pragma once
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/pipeline/security/role_files.h"

namespace fivepipe::bus {

// Returns the names of the shipped profiles.
std::vector<std::string> profile_names();

// How a process reaches the other processes of its deployment.
struct Network {
  Network(std::string profile_name = "loopback") : profile(std::move(profile_name)) {}  // NOLINT
  Network(const char* profile_name) : profile(profile_name) {}                          // NOLINT
  std::string profile;  // a file of launch/profiles
  // For a profile that reaches other machines: the name or an IPv4 address of this machine's
  // interface, and the addresses of all machines of the deployment, with this one.
  std::string interface;
  std::vector<std::string> peers;
  // The role of this process in a secured domain; nullopt: no security. CYCLONEDDS_URI does not
  // override it.
  std::optional<security::Credentials> security;
};

// By this time, discovery of all participants takes longer with security: each pair of them
// authenticates, and may begin one announcement (SPDPInterval, 1 s) late. 0 without security.
inline std::chrono::milliseconds authentication_time(const Network& network) {
  return std::chrono::milliseconds(network.security ? 1500 : 0);
}

// Returns true if the profile needs Network::interface and Network::peers.
bool reaches_other_machines(const std::string& profile);

// Returns the configuration of Cyclone DDS for the network, or that of CYCLONEDDS_URI (file://PATH
// or XML) if that is set. Throws BusError for an unknown profile, with the known names, for a
// profile that lacks interface or peers, for an interface that this machine does not have, with the
// existing ones, and for an unreadable file.
std::string profile_xml(const Network& network);

// Lowers the profile's minimum receive buffer to the size that the kernel grants, because Cyclone
// DDS creates no participant otherwise. `warning` names the setting to change; it is empty if the
// profile is unchanged.
struct FittedProfile {
  std::string xml, warning;
};
FittedProfile fitted_to_kernel(const std::string& xml, std::size_t rmem_max_bytes);

// Returns net.core.rmem_max, or 0 if it cannot be read.
std::size_t kernel_rmem_max_bytes();
// Returns whether the kernel asks several times per second for the hardware address of a machine
// that does not answer, as launch/installed/05-fivepipe.conf sets it. Otherwise it keeps
// announcements to such machines for up to 3 s, and more than one per second would block the
// others.
bool resolves_addresses_quickly();

}  // namespace fivepipe::bus
