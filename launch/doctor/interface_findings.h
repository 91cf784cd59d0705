// What `fivepipe doctor` finds out about the network interface of this machine in a deployment.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "common/base/network/network_interfaces.h"
#include "common/config/network/hosts.h"
#include "launch/doctor/finding.h"

namespace fivepipe::launch {

// Returns the name of the interface by which packets to an address leave; empty: unknown.
using RouteOf = std::function<std::string(const std::string& address)>;

// Warns if the interface that the deployment uses on this machine lacks the address of `own`, or if
// packets to another host leave by another one. used: its name; interfaces: of this machine. Pure.
std::vector<Finding> interface_findings(const config::Host& own,
                                        const std::vector<config::Host>& hosts,
                                        const std::string& used,
                                        const std::vector<base::NetworkInterface>& interfaces,
                                        const RouteOf& route);

}  // namespace fivepipe::launch
