// The network interfaces of this machine.
#pragma once
#include <string>
#include <vector>

namespace fivepipe::base {

struct NetworkInterface {
  std::string name;                    // such as "enp3s0"
  std::vector<std::string> addresses;  // IPv4, such as "192.168.10.11"
  bool is_up = false;
  bool is_loopback = false;
};

// Returns all interfaces in the system's order. Throws std::system_error if they cannot be read.
std::vector<NetworkInterface> network_interfaces();

// "lo (127.0.0.1), enp3s0 (192.168.10.11; down), wlan0 (no address)".
std::string text_of(const std::vector<NetworkInterface>& interfaces);

struct FoundInterface {
  std::string name;     // empty: none can be used
  std::string problem;  // why, for the user
};
// Finds the interface with this name or IPv4 address that is up. Throws like network_interfaces().
FoundInterface find_interface(const std::string& name_or_address);

// Returns the name of the interface by which packets to the IPv4 address leave this machine; empty
// if there is no route, or if the kernel does not tell.
std::string route_interface(const std::string& address);

}  // namespace fivepipe::base
