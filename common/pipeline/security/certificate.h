// Reads certificates, private keys and signed documents from their files.
#pragma once
#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>

#include "common/pipeline/security/openssl_handles.h"

namespace fivepipe::security {

// what() names the file and the reason.
struct SecurityError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// These functions throw SecurityError.
X509Handle read_certificate(const std::filesystem::path& file);  // PEM
Key read_private_key(const std::filesystem::path& file);         // PEM without a password
// Returns the content of an S/MIME document that the CA has signed.
std::string read_signed_document(const std::filesystem::path& file, X509& ca);

std::string subject_of(const X509& certificate);  // as RFC 2253 writes it
// Seconds since 1970.
std::int64_t not_before_s(const X509& certificate);
std::int64_t not_after_s(const X509& certificate);

}  // namespace fivepipe::security
