// Roles of the processes of a secured deployment. Each role has its own identity and permissions.
#pragma once
#include <array>
#include <string>

namespace fivepipe::security {

// launch/keys/role_topics.h lists the topics of each role.
enum class Role {
  capture,     // capture_node
  recon,       // recon_node
  sim,         // sim_node
  render,      // render_node
  supervisor,  // fivepipe up
  recorder,    // fivepipe record
  observer,    // fivepipe top, ls, echo, hz, doctor
  replay,      // fivepipe replay
  commands,    // fivepipe simulation
  tracker      // a head tracker
};
inline constexpr std::array kRoles = {
    Role::capture,  Role::recon,    Role::sim,    Role::render,   Role::supervisor,
    Role::recorder, Role::observer, Role::replay, Role::commands, Role::tracker};

// The name of the role and of the folder of its keys, such as "capture".
const char* name_of(Role role);

// program: "capture_node", "recon_node", "sim_node" or "render_node". Throws std::invalid_argument
// for any other.
Role role_of_node(const std::string& program);

// The subject of a role's certificate, as RFC 2253 writes it: "CN=capture of lab".
std::string subject_of(Role role, const std::string& deployment);

}  // namespace fivepipe::security
