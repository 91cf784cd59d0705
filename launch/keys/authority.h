// A certificate authority (CA) of a deployment: EC P-256 keys, X.509 certificates and S/MIME
// signatures by OpenSSL.
#pragma once
#include <filesystem>
#include <string>

#include "common/pipeline/security/certificate.h"
#include "launch/keys/documents.h"

namespace fivepipe::keys {

struct Identity {
  std::string certificate_pem, key_pem;
};

class Authority {
 public:
  // Makes a new CA. Throws security::SecurityError.
  Authority(const std::string& common_name, Validity validity);
  // Reads a CA from its files. Throws security::SecurityError if they are unreadable or do not fit.
  Authority(const std::filesystem::path& certificate, const std::filesystem::path& key);

  std::string certificate_pem() const;
  std::string key_pem() const;
  std::int64_t not_after_s() const { return security::not_after_s(*certificate_); }

  // The functions below throw security::SecurityError.
  // A new key and a certificate for it. common_name: the subject without "CN=".
  Identity identity(const std::string& common_name, Validity validity) const;
  // The document with its signature, as S/MIME.
  std::string signed_document(const std::string& xml) const;

 private:
  security::Key key_;
  security::X509Handle certificate_;
};

}  // namespace fivepipe::keys
