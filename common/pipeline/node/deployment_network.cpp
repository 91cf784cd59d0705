#include "common/pipeline/node/deployment_network.h"

#include <algorithm>
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

// Returns why this machine, the host `own`, cannot reach the others by its interface with the name
// or address; empty if nothing is known against it.
std::string problem_of_interface(const std::string& wanted, const std::vector<config::Host>& hosts,
                                 const std::string& own) {
  const base::FoundInterface found = base::find_interface(wanted);
  if (!found.problem.empty()) return found.problem;
  const std::vector<base::NetworkInterface> all = base::network_interfaces();
  const auto used = std::ranges::find(all, found.name, &base::NetworkInterface::name);
  if (used == all.end() || !used->is_loopback) return "";
  const auto other = std::ranges::find_if(hosts, [&](const config::Host& host) {
    return host.name != own && !host.address.starts_with("127.");
  });
  if (other == hosts.end()) return "";
  return "the network interface " + found.name + " reaches no other machine, such as host " +
         other->name + " (" + other->address +
         "). Name the interface of the machines' network, or none if it has the host's address; "
         "this machine has " +
         base::text_of(all);
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
  if (const std::string problem =
          problem_of_interface(network.interface, deployment.hosts, own.name);
      !problem.empty())
    throw config::ConfigError({{deployment.file, 0, 0, "host " + own.name + ": " + problem}});
  for (const config::Host& each : deployment.hosts) network.peers.push_back(each.address);
  return network;
}

}  // namespace fivepipe::node
