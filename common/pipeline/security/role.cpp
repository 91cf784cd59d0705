#include "common/pipeline/security/role.h"

#include <stdexcept>

namespace fivepipe::security {

const char* name_of(Role role) {
  switch (role) {
    case Role::capture: return "capture";
    case Role::recon: return "recon";
    case Role::sim: return "sim";
    case Role::render: return "render";
    case Role::supervisor: return "supervisor";
    case Role::recorder: return "recorder";
    case Role::observer: return "observer";
    case Role::replay: return "replay";
    case Role::commands: return "commands";
    case Role::tracker: return "tracker";
  }
  return "";
}

Role role_of_node(const std::string& program) {
  for (const Role role : {Role::capture, Role::recon, Role::sim, Role::render})
    if (program == std::string(name_of(role)) + "_node") return role;
  throw std::invalid_argument("no role belongs to the program " + program);
}

std::string subject_of(Role role, const std::string& deployment) {
  return std::string("CN=") + name_of(role) + " of " + deployment;
}

}  // namespace fivepipe::security
