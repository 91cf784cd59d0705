#include "launch/keys/authority.h"

#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

namespace fivepipe::keys {
namespace {

using security::Bio;
using security::Key;
using security::SecurityError;
using security::X509Handle;

void require(bool done, const char* what) {
  if (!done) throw SecurityError(std::string(what) + ": " + security::take_openssl_error());
}

Key new_key() {
  Key key(EVP_EC_gen("P-256"));
  require(key != nullptr, "cannot make a key");
  return key;
}

std::string pem_of(const Key& key) {
  const Bio text(BIO_new(BIO_s_mem()));
  require(PEM_write_bio_PrivateKey(text.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr),
          "cannot write a key");
  return security::text_of(text.get());
}

std::string pem_of(const X509Handle& certificate) {
  const Bio text(BIO_new(BIO_s_mem()));
  require(PEM_write_bio_X509(text.get(), certificate.get()), "cannot write a certificate");
  return security::text_of(text.get());
}

void add_extension(X509* certificate, X509* issuer, int nid, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, security::FreeWith<X509_EXTENSION_free>> extension(
      X509V3_EXT_conf_nid(nullptr, &context, nid, value));
  require(extension && X509_add_ext(certificate, extension.get(), -1), "certificate extension");
}

// issuer: nullptr for a CA, which signs its own certificate.
X509Handle certificate_of(const Key& key, const std::string& common_name, Validity validity,
                          X509* issuer, const Key& issuer_key) {
  X509Handle made(X509_new());
  X509* const certificate = made.get();
  std::uint64_t serial = 0;
  require(RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial) == 1, "random");
  serial >>= 1;  // a serial number is positive
  ASN1_TIME_set(X509_getm_notBefore(certificate), validity.from_s);
  ASN1_TIME_set(X509_getm_notAfter(certificate), validity.until_s);
  X509_NAME* const subject = X509_get_subject_name(certificate);
  require(X509_set_version(certificate, X509_VERSION_3) &&
              ASN1_INTEGER_set_uint64(X509_get_serialNumber(certificate), serial) &&
              X509_set_pubkey(certificate, key.get()) &&
              X509_NAME_add_entry_by_txt(
                  subject, "CN", MBSTRING_ASC,
                  reinterpret_cast<const unsigned char*>(common_name.c_str()), -1, -1, 0) &&
              X509_set_issuer_name(certificate, issuer ? X509_get_subject_name(issuer) : subject),
          "cannot make a certificate");
  X509* const authority = issuer ? issuer : certificate;
  add_extension(certificate, authority, NID_basic_constraints,
                issuer ? "critical,CA:FALSE" : "critical,CA:TRUE,pathlen:0");
  add_extension(
      certificate, authority, NID_key_usage,
      issuer ? "critical,digitalSignature,keyAgreement" : "critical,keyCertSign,digitalSignature");
  require(X509_sign(certificate, issuer_key.get(), EVP_sha256()) > 0, "cannot sign a certificate");
  return made;
}

}  // namespace

Authority::Authority(const std::string& common_name, Validity validity)
    : key_(new_key()), certificate_(certificate_of(key_, common_name, validity, nullptr, key_)) {}

Authority::Authority(const std::filesystem::path& certificate, const std::filesystem::path& key)
    : key_(security::read_private_key(key)), certificate_(security::read_certificate(certificate)) {
  if (X509_check_private_key(certificate_.get(), key_.get()) == 1) return;
  security::take_openssl_error();
  throw SecurityError(key.string() + ": not the key of " + certificate.string());
}

std::string Authority::certificate_pem() const { return pem_of(certificate_); }
std::string Authority::key_pem() const { return pem_of(key_); }

Identity Authority::identity(const std::string& common_name, Validity validity) const {
  const Key key = new_key();
  return {pem_of(certificate_of(key, common_name, validity, certificate_.get(), key_)),
          pem_of(key)};
}

std::string Authority::signed_document(const std::string& xml) const {
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED;
  const Bio content(BIO_new_mem_buf(xml.data(), int(xml.size())));
  const security::Pkcs7 signature(
      PKCS7_sign(certificate_.get(), key_.get(), nullptr, content.get(), kFlags));
  require(signature != nullptr, "cannot sign a document");
  const Bio again(BIO_new_mem_buf(xml.data(), int(xml.size()))), text(BIO_new(BIO_s_mem()));
  require(SMIME_write_PKCS7(text.get(), signature.get(), again.get(), kFlags) == 1,
          "cannot write a signed document");
  return security::text_of(text.get());
}

}  // namespace fivepipe::keys
