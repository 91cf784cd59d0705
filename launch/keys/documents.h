// The documents of DDS Security 1.1 (OMG formal/2018-04-01, sections 9.4.1.2 and 9.4.1.3), which
// the CA signs.
#pragma once
#include <cstdint>
#include <string>

#include "common/pipeline/security/role_check.h"
#include "launch/keys/role_topics.h"

namespace fivepipe::keys {

// Only authenticated participants join the domain. Every topic needs permission. Discovery and
// each submessage, with its header, are signed (AES-256-GMAC) or encrypted (AES-256-GCM).
std::string governance_xml(std::uint32_t domain, security::Protection protection);

struct Validity {  // seconds since 1970
  std::int64_t from_s = 0, until_s = 0;
};
// What the subject may do in the domain; everything else is denied. subject: as RFC 2253 writes it,
// without characters that XML reserves.
std::string permissions_xml(const std::string& subject, std::uint32_t domain, Validity validity,
                            const RoleTopics& topics);

}  // namespace fivepipe::keys
