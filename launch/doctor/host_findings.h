// What `fivepipe doctor` finds out between the hosts of a deployment.
#pragma once
#include <chrono>
#include <functional>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/bus/bus.h"
#include "launch/doctor/finding.h"
#include "launch/supervise/hosts/host_checks.h"

namespace fivepipe::launch {

// Whether the other machines answer, and how large the packets are that reach them. Takes up to 8 s
// for each.
std::vector<Finding> check_machines(const config::Deployment& deployment, const std::string& own);

// Compares this host with the others, for which `fivepipe up` or `fivepipe doctor` speaks: clock,
// version, files, and whether multicast arrives. Waits for them for at most `patience`, or until
// is_interrupted().
std::vector<Finding> compare_hosts(bus::Bus& bus, const config::Deployment& deployment,
                                   const std::string& own, std::chrono::milliseconds patience,
                                   const std::function<bool()>& is_interrupted);

// The findings about one other host. Pure.
std::vector<Finding> findings_about(const HostState& own, const ComparedHost& other);

}  // namespace fivepipe::launch
