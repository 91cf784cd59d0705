#include "launch/keys/make_keys.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "launch/keys/authority.h"

namespace fivepipe::keys {
namespace {

namespace fs = std::filesystem;
using security::Protection;
using security::Role;
using security::RoleFiles;
using security::SecurityError;

constexpr std::int64_t kDay_s = 24 * 3600;
// Of a new CA: longer than a laboratory keeps its machines.
constexpr int kCaDays = 3650;
// The clocks of the machines may differ by this time.
constexpr std::int64_t kClockDifference_s = 3600;
constexpr mode_t kPrivate = 0600, kPublic = 0644, kPrivateFolder = 0700;

[[noreturn]] void throw_errno(const fs::path& path) {
  throw SecurityError(path.string() + ": " + std::strerror(errno));
}

void make_private_folder(const fs::path& folder) {
  std::error_code error;
  if (folder.has_parent_path()) fs::create_directories(folder.parent_path(), error);
  if (mkdir(folder.c_str(), kPrivateFolder) != 0 && errno != EEXIST) throw_errno(folder);
  if (chmod(folder.c_str(), kPrivateFolder) != 0) throw_errno(folder);
}

// Replaces the file at once. No other user can read a private one at any time.
void write_file(const fs::path& file, const std::string& content, mode_t mode) {
  const fs::path temporary = file.string() + ".new";
  unlink(temporary.c_str());
  const int descriptor = open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (descriptor < 0) throw_errno(temporary);
  const bool written =
      write(descriptor, content.data(), content.size()) == ssize_t(content.size()) &&
      fsync(descriptor) == 0;
  const int write_error = errno;
  close(descriptor);
  if (written && rename(temporary.c_str(), file.c_str()) == 0) return;
  const int error = written ? errno : write_error;
  unlink(temporary.c_str());
  throw SecurityError(file.string() + ": " + std::strerror(error));
}

Authority authority_of(const KeysRequest& request, bool& made) {
  const fs::path folder = request.folder / "ca", certificate = folder / "ca.pem",
                 key = folder / "ca-key.pem";
  made = request.new_ca || (!fs::exists(certificate) && !fs::exists(key));
  if (!made) return {certificate, key};
  Authority authority(request.deployment,
                      {request.now_s - kClockDifference_s, request.now_s + kCaDays * kDay_s});
  if (!fs::exists(request.folder)) make_private_folder(request.folder);
  make_private_folder(folder);
  write_file(key, authority.key_pem(), kPrivate);
  write_file(certificate, authority.certificate_pem(), kPublic);
  return authority;
}

// The protection of the existing governance, if the CA has signed it.
std::optional<Protection> existing_protection(const KeysRequest& request) {
  const RoleFiles files{request.folder / name_of(Role::supervisor), Role::supervisor};
  try {
    const security::X509Handle ca = security::read_certificate(files.ca());
    return security::element_of(security::read_signed_document(files.governance(), *ca),
                                "metadata_protection_kind") == "SIGN"
               ? Protection::sign
               : Protection::encrypt;
  } catch (const SecurityError&) {
    return std::nullopt;
  }
}

void write_role(const KeysRequest& request, const Authority& authority, const RoleFiles& files,
                const std::string& governance, Validity validity) {
  const std::string subject = subject_of(files.role, request.deployment);
  const Identity identity = authority.identity(subject.substr(std::strlen("CN=")), validity);
  const std::string permissions = authority.signed_document(
      permissions_xml(subject, request.domain, validity, topics_of(files.role)));
  make_private_folder(files.folder);
  write_file(files.ca(), authority.certificate_pem(), kPublic);
  write_file(files.governance(), governance, kPublic);
  write_file(files.permissions(), permissions, kPublic);
  write_file(files.key(), identity.key_pem, kPrivate);
  write_file(files.identity(), identity.certificate_pem, kPublic);
}

}  // namespace

MadeKeys make_keys(const KeysRequest& request) {
  const auto before = existing_protection(request);
  MadeKeys made;
  made.protection = request.protection.value_or(before.value_or(Protection::encrypt));
  made.until_s = request.now_s + request.days * kDay_s;
  const Authority authority = authority_of(request, made.made_ca);
  if (made.until_s > authority.not_after_s())
    throw SecurityError((request.folder / "ca/ca.pem").string() + ": the CA expires at " +
                        security::utc_text(authority.not_after_s()) +
                        ", before the keys would: choose fewer --days, or make a new CA by "
                        "--force, which replaces the keys of every machine");
  const std::string governance =
      authority.signed_document(governance_xml(request.domain, made.protection));
  for (const Role role : security::kRoles)
    write_role(request, authority, {request.folder / name_of(role), role}, governance,
               {request.now_s - kClockDifference_s, made.until_s});
  return made;
}

}  // namespace fivepipe::keys
