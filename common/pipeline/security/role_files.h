// The files by which a process with a role joins a secured deployment.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/pipeline/security/role.h"

namespace fivepipe::security {

// So long before the end of a role's files a process ends, and none starts any more. `fivepipe up`
// is first: it ends its nodes within the difference.
constexpr std::int64_t expiry_margin_s(Role role) { return role == Role::supervisor ? 15 : 8; }

// One folder holds all files of a role, so that it can be copied to another machine as it is.
// The CA of permissions.p7s and governance.p7s is not that of the identities: Cyclone DDS accepts a
// document if its signer has any certificate of the CA, so that a role could sign its own
// permissions.
struct RoleFiles {
  std::filesystem::path folder;
  Role role = Role::observer;

  std::filesystem::path ca() const { return folder / "ca.pem"; }
  std::filesystem::path permissions_ca() const { return folder / "permissions-ca.pem"; }
  std::filesystem::path identity() const { return folder / "identity.pem"; }
  std::filesystem::path key() const { return folder / "key.pem"; }
  std::filesystem::path governance() const { return folder / "governance.p7s"; }
  std::filesystem::path permissions() const { return folder / "permissions.p7s"; }
  std::vector<std::filesystem::path> all() const {
    return {ca(), permissions_ca(), identity(), key(), governance(), permissions()};
  }
};

// What a participant needs to join.
struct Credentials {
  RoleFiles files;
  std::string remedy;                 // the command that makes the files, for messages
  std::vector<std::string> warnings;  // for the log of the process
  // The earliest expiry of the files [s since 1970]; 0: not known. Bus ends the process before it.
  std::int64_t expires_s = 0;
};

}  // namespace fivepipe::security
