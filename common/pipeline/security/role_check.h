// Checks the files of a role before DDS uses them, whose messages name neither file nor remedy.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "common/pipeline/security/certificate.h"
#include "common/pipeline/security/role_files.h"

namespace fivepipe::security {

enum class Protection { sign, encrypt };
inline const char* name_of(Protection protection) {
  return protection == Protection::sign ? "sign" : "encrypt";
}
// What messages are: "signed" or "encrypted".
inline const char* participle_of(Protection protection) {
  return protection == Protection::sign ? "signed" : "encrypted";
}

inline constexpr std::int64_t kDay_s = 24 * 3600;

// A file is reported if it expires in less than this time.
inline constexpr std::int64_t kExpiresSoon_s = 30 * kDay_s;

struct CheckedRole {
  Protection protection = Protection::encrypt;  // of all messages of the domain
  std::int64_t not_after_s = 0;                 // the earliest end of the files
  std::vector<std::string> warnings;            // a key that others can read, a near expiry
};

// deployment: its name. now_s: seconds since 1970. Throws SecurityError if a file is missing,
// unreadable or not valid now, belongs to another role, deployment, CA or domain, or does not fit
// the others.
CheckedRole check_role(const RoleFiles& files, const std::string& deployment, std::uint32_t domain,
                       std::int64_t now_s);

// The protection that a governance document states. Throws SecurityError, also if `ca` has not
// signed it.
Protection protection_of(const std::filesystem::path& governance, X509& ca);

// "keys/sim/identity.pem expires at 2027-03-01 12:00 UTC, in 29 days".
std::string expiry_text(const std::filesystem::path& file, std::int64_t until_s,
                        std::int64_t now_s);

// "2027-03-01 12:00 UTC", for people.
std::string utc_text(std::int64_t time_s);
// "2027-03-01T12:00:00Z", as the documents of DDS Security write it.
std::string iso_text(std::int64_t time_s);

// Returns the text between the first <element> and </element>; empty if there is none.
std::string element_of(const std::string& xml, const std::string& element);

}  // namespace fivepipe::security
