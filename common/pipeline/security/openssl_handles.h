// Owning pointers to the objects of OpenSSL, and its errors as text.
#pragma once
#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>

#include <memory>
#include <string>

namespace fivepipe::security {

template <auto free_function>
struct FreeWith {
  template <class Object>
  void operator()(Object* object) const {
    free_function(object);
  }
};
using Bio = std::unique_ptr<BIO, FreeWith<BIO_free_all>>;
using X509Handle = std::unique_ptr<X509, FreeWith<X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, FreeWith<EVP_PKEY_free>>;
using Pkcs7 = std::unique_ptr<PKCS7, FreeWith<PKCS7_free>>;

// Removes the errors of this thread from OpenSSL's queue and returns the first one as text.
inline std::string take_openssl_error() {
  const unsigned long first = ERR_get_error();  // NOLINT(google-runtime-int): OpenSSL's type
  ERR_clear_error();
  const char* const reason = first ? ERR_reason_error_string(first) : nullptr;
  return reason ? reason : "unknown error";
}

// A copy of the text that a BIO in memory holds.
inline std::string text_of(BIO* memory) {
  char* text = nullptr;
  const auto size = BIO_get_mem_data(memory, &text);
  return {text, std::size_t(size)};
}

}  // namespace fivepipe::security
