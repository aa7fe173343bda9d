#include "front/own_identity.hpp"

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <memory>

namespace scanloc::server {
namespace {

constexpr const char* kProbeName = "scanlocd's own probe";

std::string TextOf(BIO& memory) {
  char* text = nullptr;
  const long size = BIO_get_mem_data(&memory, &text);
  return {text, static_cast<std::size_t>(size)};
}

bool Fill(X509& certificate, EVP_PKEY* key) {
  X509_NAME* name = X509_get_subject_name(&certificate);
  return X509_set_version(&certificate, 2) == 1 &&  // counted from 0: version 3
         ASN1_INTEGER_set(X509_get_serialNumber(&certificate), 1) == 1 &&
         ASN1_TIME_set_string(X509_getm_notBefore(&certificate), "19700101000000Z") == 1 &&
         ASN1_TIME_set_string(X509_getm_notAfter(&certificate), "99991231235959Z") == 1 &&
         X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC,
                                    reinterpret_cast<const unsigned char*>(kProbeName), -1, -1,
                                    0) == 1 &&
         X509_set_issuer_name(&certificate, name) == 1 && X509_set_pubkey(&certificate, key) == 1 &&
         X509_sign(&certificate, key, EVP_sha256()) != 0;
}

}  // namespace

absl::StatusOr<OwnIdentity> MakeOwnIdentity() {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(X509_new(), X509_free);
  const std::unique_ptr<BIO, decltype(&BIO_free)> cert_text(BIO_new(BIO_s_mem()), BIO_free);
  const std::unique_ptr<BIO, decltype(&BIO_free)> key_text(BIO_new(BIO_s_mem()), BIO_free);
  if (key == nullptr || certificate == nullptr || cert_text == nullptr || key_text == nullptr ||
      !Fill(*certificate, key.get()) ||
      PEM_write_bio_X509(cert_text.get(), certificate.get()) != 1 ||
      PEM_write_bio_PrivateKey(key_text.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) !=
          1) {
    return absl::InternalError("cannot make a certificate to ask this server itself with");
  }
  return OwnIdentity{.cert = TextOf(*cert_text), .key = TextOf(*key_text)};
}

}  // namespace scanloc::server
