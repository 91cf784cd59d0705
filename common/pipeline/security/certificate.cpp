#include "common/pipeline/security/certificate.h"

#include <openssl/pem.h>

#include <ctime>

#include "common/base/readable_file.h"

namespace fivepipe::security {
namespace {

Bio opened(const std::filesystem::path& file) {
  if (const auto why = base::why_unreadable(file)) throw SecurityError(file.string() + ": " + *why);
  Bio bio(BIO_new_file(file.c_str(), "rb"));
  if (!bio) throw SecurityError(file.string() + ": " + take_openssl_error());
  return bio;
}

std::int64_t seconds_of(const ASN1_TIME* time) {
  std::tm utc{};
  return ASN1_TIME_to_tm(time, &utc) == 1 ? std::int64_t(timegm(&utc)) : 0;
}

// sk_X509_free is a macro. The certificates stay alive.
void free_stack(STACK_OF(X509) * stack) { sk_X509_free(stack); }

// OpenSSL would ask for a password on the terminal.
int no_password(char*, int, int, void*) { return -1; }

}  // namespace

X509Handle read_certificate(const std::filesystem::path& file) {
  const Bio bio = opened(file);
  X509Handle certificate(PEM_read_bio_X509(bio.get(), nullptr, no_password, nullptr));
  if (!certificate)
    throw SecurityError(file.string() + ": no certificate in PEM: " + take_openssl_error());
  return certificate;
}

Key read_private_key(const std::filesystem::path& file) {
  const Bio bio = opened(file);
  Key key(PEM_read_bio_PrivateKey(bio.get(), nullptr, no_password, nullptr));
  if (!key) throw SecurityError(file.string() + ": no private key in PEM: " + take_openssl_error());
  return key;
}

std::string read_signed_document(const std::filesystem::path& file, X509& ca) {
  const Bio bio = opened(file);
  BIO* detached = nullptr;
  const Pkcs7 signature(SMIME_read_PKCS7(bio.get(), &detached));
  const Bio content(detached);
  if (!signature)
    throw SecurityError(file.string() + ": no signed document: " + take_openssl_error());
  const std::unique_ptr<X509_STORE, FreeWith<X509_STORE_free>> store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), &ca);
  const Bio text(BIO_new(BIO_s_mem()));
  // Accepts only the CA itself as signer. Cyclone DDS also accepts any signer with a certificate of
  // the CA.
  const std::unique_ptr<STACK_OF(X509), FreeWith<free_stack>> signers(sk_X509_new_null());
  sk_X509_push(signers.get(), &ca);
  if (PKCS7_verify(signature.get(), signers.get(), store.get(), content.get(), text.get(),
                   PKCS7_TEXT | PKCS7_NOINTERN | PKCS7_NOVERIFY) != 1)
    throw SecurityError(file.string() +
                        ": not signed by the CA of its folder: " + take_openssl_error());
  return text_of(text.get());
}

std::string subject_of(const X509& certificate) {
  const Bio text(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(text.get(), X509_get_subject_name(&certificate), 0, XN_FLAG_RFC2253);
  return text_of(text.get());
}

std::int64_t not_before_s(const X509& certificate) {
  return seconds_of(X509_get0_notBefore(&certificate));
}
std::int64_t not_after_s(const X509& certificate) {
  return seconds_of(X509_get0_notAfter(&certificate));
}

}  // namespace fivepipe::security
