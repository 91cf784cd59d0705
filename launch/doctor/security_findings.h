// The keys of a secured deployment on this machine.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/config/deployment.h"
#include "common/pipeline/security/role.h"
#include "launch/doctor/finding.h"

namespace fivepipe::launch {

// Returns a finding for each role whose keys this machine has, and for each role that its nodes and
// their `fivepipe up` need and that it lacks. host: as `fivepipe up --host`; empty: this machine.
// now_s: seconds since 1970.
std::vector<Finding> check_security(const config::Deployment& deployment, std::uint32_t domain,
                                    const std::string& host, std::int64_t now_s);

// The role that may publish HostStatus, which compares hosts.
inline constexpr security::Role kComparingRole = security::Role::supervisor;

// Returns the role with which doctor joins the domain: kComparingRole if this machine has its keys.
security::Role role_of_doctor(const config::Deployment& deployment);

}  // namespace fivepipe::launch
