// Makes the folder of keys of a deployment.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/security/role_check.h"

namespace fivepipe::keys {

// Days for which a new CA is valid: longer than a laboratory keeps its machines.
inline constexpr int kCaDays = 3650;

struct KeysRequest {
  std::filesystem::path folder;  // made if it does not exist
  std::string deployment;        // name
  std::uint32_t domain = 0;      // the permissions are valid in this DDS domain only
  // nullopt: that of the existing keys, else encrypt.
  std::optional<security::Protection> protection;
  int days = 365;          // validity of the identities and permissions, from now on
  bool new_ca = false;     // replaces an existing CA
  std::int64_t now_s = 0;  // seconds since 1970
};

struct MadeKeys {
  security::Protection protection = security::Protection::encrypt;
  std::int64_t until_s = 0;  // end of validity of the identities
  bool made_ca = false;
};

// Makes the folder ca/ with the CA of the identities and that of the permissions, unless it exists,
// and for each role a folder with the files of security::RoleFiles. Private keys have mode 0600,
// the folders 0700 (KeysRequest::folder only if it is new). Each folder appears complete or not at
// all. Throws security::SecurityError; a role that was not reached keeps its old files, which are
// valid with the same CAs, unless new_ca.
MadeKeys make_keys(const KeysRequest& request);

}  // namespace fivepipe::keys
