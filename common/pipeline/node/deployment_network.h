// The network of a deployment, as a process on one of its hosts joins it.
#pragma once
#include <string>

#include "common/config/deployment.h"
#include "common/pipeline/bus/profile.h"

namespace fivepipe::node {

// host: name of this machine in the deployment; empty: own_host() finds it. local: the loopback
// interface instead. Throws ConfigError.
bus::Network network_of(const config::Deployment& deployment, const std::string& host, bool local);

}  // namespace fivepipe::node
