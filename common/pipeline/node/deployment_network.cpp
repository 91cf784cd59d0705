#include "common/pipeline/node/deployment_network.h"

#include <ctime>

#include "common/base/network/network_interfaces.h"
#include "common/config/yaml/config_error.h"
#include "common/pipeline/security/role_check.h"

namespace fivepipe::node {
namespace {

security::Credentials credentials_of(const config::Deployment& deployment, const Joining& joining) {
  security::Credentials credentials{
      role_files(deployment, joining.role), keys_command(deployment), {}, 0};
  try {
    security::CheckedRole checked = security::check_role(credentials.files, deployment.name,
                                                         joining.domain, std::time(nullptr));
    if (const std::int64_t now_s = std::time(nullptr);
        checked.not_after_s - now_s <= security::expiry_margin_s(joining.role))
      throw security::SecurityError(
          "its keys expire at " + security::utc_text(checked.not_after_s) + ", too soon to start");
    credentials.warnings = std::move(checked.warnings);
    credentials.expires_s = checked.not_after_s;
  } catch (const security::SecurityError& error) {
    const std::string folder = credentials.files.folder.string();
    throw config::ConfigError(
        {{deployment.file, deployment.security->line, 0,
          "role " + std::string(name_of(joining.role)) + " cannot join: " + error.what() + ". " +
              credentials.remedy + " makes the keys, on the machine that has the CA; copy " +
              folder + " from there"}});
  }
  return credentials;
}

}  // namespace

security::RoleFiles role_files(const config::Deployment& deployment, security::Role role) {
  return {deployment.security->keys / security::name_of(role), role};
}

std::string keys_command(const config::Deployment& deployment) {
  return "`fivepipe keys " + deployment.file.string() + "`";
}

bus::Network network_of(const config::Deployment& deployment, const Joining& joining) {
  if (joining.local) return {};
  bus::Network network = deployment.network_profile;
  if (deployment.security) network.security = credentials_of(deployment, joining);
  if (deployment.hosts.empty() || !bus::reaches_other_machines(network.profile)) return network;
  const config::Host& own = config::own_host(deployment.hosts, joining.host, deployment.file);
  network.interface = own.interface.empty() ? own.address : own.interface;
  // BusError would not name the file.
  if (const std::string problem = base::find_interface(network.interface).problem; !problem.empty())
    throw config::ConfigError({{deployment.file, 0, 0, "host " + own.name + ": " + problem}});
  for (const config::Host& each : deployment.hosts) network.peers.push_back(each.address);
  return network;
}

}  // namespace fivepipe::node
