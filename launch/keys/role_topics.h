// The topics that each role may publish and subscribe.
#pragma once
#include <string>
#include <vector>

#include "common/pipeline/security/role.h"

namespace fivepipe::keys {

struct RoleTopics {
  std::vector<std::string> publishes, subscribes;  // names, in which * matches any characters
};

// Returns the topics that the programs of the role use, and no other.
RoleTopics topics_of(security::Role role);

}  // namespace fivepipe::keys
