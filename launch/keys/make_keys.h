// Makes the folder of keys of a deployment.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/pipeline/security/role_check.h"

namespace fivepipe::keys {

struct KeysRequest {
  std::filesystem::path folder;  // made if it does not exist
  std::string deployment;        // name
  std::uint32_t domain = 0;      // the permissions are valid in this DDS domain only
  // nullopt: that of the existing governance, else encrypt.
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

// Writes ca/ca.pem and ca/ca-key.pem, if they do not exist, and for each role a folder with the
// files of security::RoleFiles. Private keys have mode 0600, the folders 0700 (KeysRequest::folder
// only if it is new). A file appears
// complete or not at all. Throws security::SecurityError; a role that was not reached keeps its old
// files, which are valid with the same CA.
MadeKeys make_keys(const KeysRequest& request);

}  // namespace fivepipe::keys
