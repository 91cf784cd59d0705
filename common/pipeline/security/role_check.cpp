#include "common/pipeline/security/role_check.h"

#include <sys/stat.h>

#include <algorithm>
#include <ctime>

namespace fivepipe::security {
namespace {

constexpr std::int64_t kDay_s = 24 * 3600;

void check_validity(const std::filesystem::path& file, const X509& certificate,
                    std::int64_t now_s) {
  if (now_s < not_before_s(certificate))
    throw SecurityError(file.string() + ": valid only from " + utc_text(not_before_s(certificate)) +
                        "; the clock of this machine says " + utc_text(now_s));
  if (now_s >= not_after_s(certificate))
    throw SecurityError(file.string() + ": expired at " + utc_text(not_after_s(certificate)));
}

void check_identity(const RoleFiles& files, const X509& identity, X509& ca,
                    const std::string& deployment) {
  const std::string file = files.identity().string(), wanted = subject_of(files.role, deployment),
                    found = subject_of(identity);
  if (found != wanted)
    throw SecurityError(file + ": belongs to '" + found + "', not to '" + wanted + "'");
  if (X509_verify(const_cast<X509*>(&identity), X509_get0_pubkey(&ca)) != 1) {
    take_openssl_error();
    throw SecurityError(file + ": not signed by " + files.ca().string());
  }
  if (X509_check_private_key(&identity, read_private_key(files.key()).get()) != 1) {
    take_openssl_error();
    throw SecurityError(files.key().string() + ": not the key of " + file);
  }
}

Protection protection_of(const RoleFiles& files, X509& ca) {
  const std::string kind =
      element_of(read_signed_document(files.governance(), ca), "metadata_protection_kind");
  if (kind == "SIGN") return Protection::sign;
  if (kind == "ENCRYPT") return Protection::encrypt;
  throw SecurityError(files.governance().string() + ": metadata_protection_kind is '" + kind +
                      "', neither SIGN nor ENCRYPT");
}

void check_permissions(const RoleFiles& files, X509& ca, const std::string& deployment,
                       std::uint32_t domain, std::int64_t now_s) {
  const std::string xml = read_signed_document(files.permissions(), ca),
                    file = files.permissions().string();
  if (const std::string subject = element_of(xml, "subject_name");
      subject != subject_of(files.role, deployment))
    throw SecurityError(file + ": belongs to '" + subject + "', not to '" +
                        subject_of(files.role, deployment) + "'");
  if (const std::string id = element_of(xml, "id"); id != std::to_string(domain))
    throw SecurityError(file + ": made for DDS domain " + id + ", not for domain " +
                        std::to_string(domain) +
                        "; set `domain` in the deployment file before the keys are made");
  // Texts of this form are in the order of time.
  if (const std::string until = element_of(xml, "not_after"); until <= iso_text(now_s))
    throw SecurityError(file + ": expired at " + until);
}

std::string formatted(std::int64_t time_s, const char* format) {
  const std::time_t time = time_s;
  std::tm utc{};
  gmtime_r(&time, &utc);
  char text[64];
  return {text, std::strftime(text, sizeof text, format, &utc)};
}

}  // namespace

CheckedRole check_role(const RoleFiles& files, const std::string& deployment, std::uint32_t domain,
                       std::int64_t now_s) {
  const X509Handle ca = read_certificate(files.ca()), identity = read_certificate(files.identity());
  check_validity(files.ca(), *ca, now_s);
  check_validity(files.identity(), *identity, now_s);
  check_identity(files, *identity, *ca, deployment);
  CheckedRole checked;
  checked.protection = protection_of(files, *ca);
  check_permissions(files, *ca, deployment, domain, now_s);
  checked.not_after_s = std::min(not_after_s(*ca), not_after_s(*identity));
  if (checked.not_after_s - now_s < kExpiresSoon_s)
    checked.warnings.push_back("the certificate of role " + std::string(name_of(files.role)) +
                               " expires at " + utc_text(checked.not_after_s) + ", in " +
                               std::to_string((checked.not_after_s - now_s) / kDay_s) + " days");
  struct stat status {};
  if (stat(files.key().c_str(), &status) == 0 && (status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    checked.warnings.push_back("other users can read " + files.key().string() + ": run chmod 600 " +
                               files.key().string());
  return checked;
}

std::string utc_text(std::int64_t time_s) { return formatted(time_s, "%Y-%m-%d %H:%M UTC"); }
std::string iso_text(std::int64_t time_s) { return formatted(time_s, "%Y-%m-%dT%H:%M:%SZ"); }

std::string element_of(const std::string& xml, const std::string& element) {
  const std::string open = "<" + element + ">", close = "</" + element + ">";
  const std::size_t begin = xml.find(open);
  const std::size_t end = begin == std::string::npos ? begin : xml.find(close, begin);
  if (end == std::string::npos) return "";
  return xml.substr(begin + open.size(), end - begin - open.size());
}

}  // namespace fivepipe::security
