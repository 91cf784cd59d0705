#include "launch/keys/make_keys.h"

#include <cstring>
#include <optional>

#include "launch/keys/authority.h"
#include "launch/keys/key_files.h"

namespace fivepipe::keys {
namespace {

namespace fs = std::filesystem;
using security::Protection;
using security::Role;
using security::RoleFiles;
using security::SecurityError;

// The clocks of the machines may differ by this time.
constexpr std::int64_t kClockDifference_s = 3600;

// The files of ca/.
constexpr const char *kCa = "ca.pem", *kCaKey = "ca-key.pem",
                     *kPermissionsCa = "permissions-ca.pem",
                     *kPermissionsCaKey = "permissions-ca-key.pem",
                     *kGovernanceFile = "governance.p7s";

// The two CAs of a deployment. RoleFiles states why there are two.
struct Authorities {
  Authority identities, permissions;
};

bool is_there(const fs::path& path) {
  std::error_code error;
  const bool found = fs::exists(path, error);
  if (error) throw SecurityError(path.string() + ": " + error.message());
  return found;
}

bool has_authorities(const fs::path& folder) {
  for (const char* const file : {kCa, kCaKey, kPermissionsCa, kPermissionsCaKey})
    if (is_there(folder / file)) return true;
  return false;
}

Authorities read_authorities(const fs::path& folder) {
  try {
    return {{folder / kCa, folder / kCaKey}, {folder / kPermissionsCa, folder / kPermissionsCaKey}};
  } catch (const SecurityError& error) {
    throw SecurityError(std::string(error.what()) +
                        "; restore the file, or make new CAs by --force, which replaces the keys "
                        "of every machine");
  }
}

// The protection of the existing keys.
Protection existing_protection(const fs::path& folder) {
  try {
    const security::X509Handle ca = security::read_certificate(folder / kPermissionsCa);
    return security::protection_of(folder / kGovernanceFile, *ca);
  } catch (const SecurityError& error) {
    throw SecurityError(std::string(error.what()) +
                        "; state the protection that the existing keys have: --protection sign or "
                        "--protection encrypt");
  }
}

void write_role(const KeysRequest& request, const Authorities& authorities, const RoleFiles& files,
                const std::string& governance, Validity validity) {
  const std::string subject = subject_of(files.role, request.deployment);
  const Identity identity =
      authorities.identities.identity(subject.substr(std::strlen("CN=")), validity);
  const std::string permissions = authorities.permissions.signed_document(
      permissions_xml(subject, request.domain, validity, topics_of(files.role)));
  write_folder(
      files.folder,
      {{files.ca().filename(), authorities.identities.certificate_pem(), false},
       {files.permissions_ca().filename(), authorities.permissions.certificate_pem(), false},
       {files.governance().filename(), governance, false},
       {files.permissions().filename(), permissions, false},
       {files.key().filename(), identity.key_pem, true},
       {files.identity().filename(), identity.certificate_pem, false}});
}

}  // namespace

MadeKeys make_keys(const KeysRequest& request) {
  const fs::path folder = request.folder / "ca";
  MadeKeys made;
  recover(folder);
  const bool has_before = has_authorities(folder);
  made.made_ca = request.new_ca || !has_before;
  std::optional<Authorities> authorities;
  if (!made.made_ca) authorities.emplace(read_authorities(folder));
  made.protection = request.protection ? *request.protection
                    : has_before       ? existing_protection(folder)
                                       : Protection::encrypt;
  made.until_s = request.now_s + request.days * security::kDay_s;
  const Validity validity_of_ca{request.now_s - kClockDifference_s,
                                request.now_s + kCaDays * security::kDay_s};
  if (!authorities)
    authorities.emplace(Authorities{{"CA of " + request.deployment, validity_of_ca},
                                    {"permissions CA of " + request.deployment, validity_of_ca}});
  for (const Authority* const authority : {&authorities->identities, &authorities->permissions})
    if (made.until_s > authority->not_after_s())
      throw SecurityError((folder / kCa).string() + ": the CA expires at " +
                          security::utc_text(authority->not_after_s()) +
                          ", before the keys would: choose fewer --days, or make a new CA by "
                          "--force, which replaces the keys of every machine");
  const std::string governance =
      authorities->permissions.signed_document(governance_xml(request.domain, made.protection));
  if (made.made_ca)
    write_folder(folder, {{kCa, authorities->identities.certificate_pem(), false},
                          {kCaKey, authorities->identities.key_pem(), true},
                          {kPermissionsCa, authorities->permissions.certificate_pem(), false},
                          {kPermissionsCaKey, authorities->permissions.key_pem(), true},
                          {kGovernanceFile, governance, false}});
  else
    write_file(folder, {kGovernanceFile, governance, false});
  for (const Role role : security::kRoles)
    write_role(request, *authorities, {request.folder / name_of(role), role}, governance,
               {request.now_s - kClockDifference_s, made.until_s});
  return made;
}

}  // namespace fivepipe::keys
