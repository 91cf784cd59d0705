#include "common/pipeline/node/deployment_network.h"

#include "common/base/network/network_interfaces.h"
#include "common/config/yaml/config_error.h"

namespace fivepipe::node {

bus::Network network_of(const config::Deployment& deployment, const std::string& host, bool local) {
  if (local) return {};
  bus::Network network = deployment.network_profile;
  if (deployment.hosts.empty() || !bus::reaches_other_machines(network.profile)) return network;
  const config::Host& own = config::own_host(deployment.hosts, host, deployment.file);
  network.interface = own.interface.empty() ? own.address : own.interface;
  // BusError would not name the file.
  if (const std::string problem = base::find_interface(network.interface).problem; !problem.empty())
    throw config::ConfigError({{deployment.file, 0, 0, "host " + own.name + ": " + problem}});
  for (const config::Host& each : deployment.hosts) network.peers.push_back(each.address);
  return network;
}

}  // namespace fivepipe::node
