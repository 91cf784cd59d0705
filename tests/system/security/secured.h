// Keys for tests of secured deployments.
#pragma once
#include <ctime>
#include <filesystem>

#include "common/pipeline/security/role_files.h"
#include "launch/keys/make_keys.h"

namespace fivepipe::test {

// The keys of the deployment "small", which `days` days ago were made for a year.
inline void make_small_keys(const std::filesystem::path& folder, std::uint32_t domain,
                            security::Protection protection = security::Protection::encrypt,
                            int days_ago = 0) {
  keys::make_keys({.folder = folder,
                   .deployment = "small",
                   .domain = domain,
                   .protection = protection,
                   .now_s = std::time(nullptr) - std::int64_t(days_ago) * 24 * 3600});
}

inline security::RoleFiles files_of(const std::filesystem::path& folder, security::Role role) {
  return {folder / security::name_of(role), role};
}

}  // namespace fivepipe::test
