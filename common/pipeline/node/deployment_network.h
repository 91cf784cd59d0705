// The network of a deployment, as a process on one of its hosts joins it.
#pragma once
#include <cstdint>
#include <string>

#include "common/config/deployment.h"
#include "common/pipeline/bus/profile.h"
#include "common/pipeline/security/role_files.h"

namespace fivepipe::node {

// The keys of a role in a deployment that has Deployment::security. The files may not exist.
security::RoleFiles role_files(const config::Deployment& deployment, security::Role role);

// The command that makes the keys of the deployment, for messages.
std::string keys_command(const config::Deployment& deployment);

struct Joining {
  security::Role role = security::Role::observer;  // of the process, if the deployment is secured
  std::uint32_t domain = 0;                        // as BusOptions::domain
  std::string host = "";  // name of this machine in the deployment; empty: own_host() finds it
  bool local = false;     // the loopback interface instead, without security
};
// Throws ConfigError, also if the keys of the role are missing or not valid.
bus::Network network_of(const config::Deployment& deployment, const Joining& joining);

}  // namespace fivepipe::node
