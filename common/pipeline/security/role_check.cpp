#include "common/pipeline/security/role_check.h"

#include <sys/stat.h>

#include <algorithm>
#include <ctime>
#include <map>

#include "common/base/text_table.h"

namespace fivepipe::security {
namespace {

constexpr const char* kIsoFormat = "%Y-%m-%dT%H:%M:%SZ";

void check_validity(const std::filesystem::path& file, std::int64_t from_s, std::int64_t until_s,
                    std::int64_t now_s) {
  if (now_s < from_s)
    throw SecurityError(file.string() + ": valid only from " + utc_text(from_s) +
                        "; the clock of this machine is at " + utc_text(now_s));
  if (now_s >= until_s) throw SecurityError(file.string() + ": expired at " + utc_text(until_s));
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

std::int64_t time_in(const std::string& xml, const std::string& element, const std::string& file) {
  const std::string text = element_of(xml, element);
  std::tm utc{};
  const char* const end = strptime(text.c_str(), kIsoFormat, &utc);
  if (!end || *end)
    throw SecurityError(file + ": " + element + " is '" + text + "', not a time such as " +
                        iso_text(0));
  return timegm(&utc);
}

// Returns the end of the permissions.
std::int64_t check_permissions(const RoleFiles& files, X509& ca, const std::string& deployment,
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
  const std::int64_t from_s = time_in(xml, "not_before", file),
                     until_s = time_in(xml, "not_after", file);
  check_validity(file, from_s, until_s, now_s);
  return until_s;
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
  const X509Handle ca = read_certificate(files.ca()),
                   permissions_ca = read_certificate(files.permissions_ca()),
                   identity = read_certificate(files.identity());
  std::map<std::filesystem::path, std::int64_t> ends_s;
  for (const auto& [file, certificate] : {std::pair(files.ca(), ca.get()),
                                          {files.permissions_ca(), permissions_ca.get()},
                                          {files.identity(), identity.get()}}) {
    ends_s[file] = not_after_s(*certificate);
    check_validity(file, not_before_s(*certificate), not_after_s(*certificate), now_s);
  }
  check_identity(files, *identity, *ca, deployment);
  CheckedRole checked;
  checked.protection = protection_of(files.governance(), *permissions_ca);
  ends_s[files.permissions()] =
      check_permissions(files, *permissions_ca, deployment, domain, now_s);
  const auto first =
      std::ranges::min_element(ends_s, {}, [](const auto& end) { return end.second; });
  checked.not_after_s = first->second;
  if (checked.not_after_s - now_s < kExpiresSoon_s)
    checked.warnings.push_back(expiry_text(first->first, checked.not_after_s, now_s));
  struct stat status {};
  if (stat(files.key().c_str(), &status) == 0 && (status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    checked.warnings.push_back("other users can read " + files.key().string() + ": run chmod 600 " +
                               files.key().string());
  return checked;
}

Protection protection_of(const std::filesystem::path& governance, X509& ca) {
  const std::string kind =
      element_of(read_signed_document(governance, ca), "metadata_protection_kind");
  if (kind == "SIGN") return Protection::sign;
  if (kind == "ENCRYPT") return Protection::encrypt;
  throw SecurityError(governance.string() + ": metadata_protection_kind is '" + kind +
                      "', neither SIGN nor ENCRYPT");
}

std::string expiry_text(const std::filesystem::path& file, std::int64_t until_s,
                        std::int64_t now_s) {
  const std::int64_t hours = (until_s - now_s) / 3600, days = hours / 24;
  return file.string() + " expires at " + utc_text(until_s) + ", in " +
         (days > 1 ? base::counted(std::uint64_t(days), "day")
                   : base::counted(std::uint64_t(std::max<std::int64_t>(hours, 0)), "hour"));
}

std::string utc_text(std::int64_t time_s) { return formatted(time_s, "%Y-%m-%d %H:%M UTC"); }
std::string iso_text(std::int64_t time_s) { return formatted(time_s, kIsoFormat); }

std::string element_of(const std::string& xml, const std::string& element) {
  const std::string open = "<" + element + ">", close = "</" + element + ">";
  const std::size_t begin = xml.find(open);
  const std::size_t end = begin == std::string::npos ? begin : xml.find(close, begin);
  if (end == std::string::npos) return "";
  return xml.substr(begin + open.size(), end - begin - open.size());
}

}  // namespace fivepipe::security
