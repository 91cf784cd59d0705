#include "launch/doctor/security_findings.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <system_error>

#include "common/config/yaml/config_error.h"
#include "common/pipeline/node/deployment_network.h"
#include "common/pipeline/security/role_check.h"
#include "launch/supervise/hosts/hosts.h"

namespace fivepipe::launch {
namespace {

using security::Role;

// The roles that have a folder on this machine. unreadable: whether it cannot be looked for.
std::vector<Role> roles_here(const config::Deployment& deployment,
                             std::error_code* unreadable = nullptr) {
  std::vector<Role> here;
  for (const Role role : security::kRoles) {
    std::error_code error;
    if (std::filesystem::exists(node::role_files(deployment, role).folder, error))
      here.push_back(role);
    if (error && unreadable) *unreadable = error;
  }
  return here;
}

// The roles that this machine needs, each with the process that does.
std::map<Role, std::string> needed_roles(const config::Deployment& deployment,
                                         const std::string& host) {
  std::map<Role, std::string> needed;
  try {
    for (const config::Node& node : nodes_of_host(deployment, host)) {
      needed.emplace(security::role_of_node(config::program_of(node)), "node " + node.name);
      needed.emplace(Role::supervisor, "`fivepipe up`");
    }
  } catch (const config::ConfigError&) {
    // No node runs here. A host that cannot be found is a finding of its own.
  }
  return needed;
}

Finding check_role_keys(const config::Deployment& deployment, std::uint32_t domain, Role role,
                        std::int64_t now_s) {
  const std::string what = std::string("security: role ") + name_of(role) + ": ";
  try {
    const security::CheckedRole checked =
        security::check_role(node::role_files(deployment, role), deployment.name, domain, now_s);
    std::string advice;
    for (const std::string& warning : checked.warnings)
      advice += (advice.empty() ? "" : "; ") + warning;
    return {advice.empty() ? Verdict::ok : Verdict::warn,
            what + participle_of(checked.protection) + ", valid until " +
                security::utc_text(checked.not_after_s),
            advice};
  } catch (const security::SecurityError& error) {
    return {Verdict::fail, what + error.what(),
            "if this user may not read the file, run doctor as the user of the service; else make "
            "new keys on the machine with the CA: " +
                node::keys_command(deployment)};
  }
}

}  // namespace

std::vector<Finding> check_security(const config::Deployment& deployment, std::uint32_t domain,
                                    const std::string& host, std::int64_t now_s) {
  if (!deployment.security)
    return {{Verdict::ok, "security: off, as the deployment file has no `security`", ""}};
  std::error_code unreadable;
  const std::vector<Role> here = roles_here(deployment, &unreadable);
  const std::string& folder = deployment.security->keys.string();
  if (unreadable)
    return {{Verdict::fail, "security: " + folder + ": " + unreadable.message(),
             "run doctor as the user of the service: sudo -u USER fivepipe doctor ..."}};
  std::vector<Finding> findings;
  for (const Role role : here) findings.push_back(check_role_keys(deployment, domain, role, now_s));
  for (const auto& [role, process] : needed_roles(deployment, host))
    if (std::ranges::count(here, role) == 0)
      findings.push_back({Verdict::fail,
                          std::string("security: role ") + name_of(role) + ": no keys in " +
                              folder + ", but " + process + " of this machine needs them",
                          "copy the folder of the role from the machine with the CA, or make it "
                          "there by " +
                              node::keys_command(deployment)});
  if (findings.empty())
    findings.push_back({Verdict::warn, "security: no keys in " + folder,
                        "commands need those of their roles: copy the folders from the machine "
                        "with the CA"});
  return findings;
}

Role role_of_doctor(const config::Deployment& deployment) {
  if (!deployment.security) return Role::observer;
  const std::vector<Role> here = roles_here(deployment);
  for (const Role role : {kComparingRole, Role::observer})
    if (std::ranges::count(here, role) > 0) return role;
  return here.empty() ? Role::observer : here.front();
}

}  // namespace fivepipe::launch
