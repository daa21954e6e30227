#include "clients/tubectl/run/room_authority.hpp"

#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <utility>

namespace tubed {
namespace {

constexpr int kVersion3 = 2;
constexpr int kSerialBits = 127;  // RFC 5280 Sec. 4.1.2.2: positive, at most 20 octets

/// OpenSSL's functions return 1, or a pointer, when they succeed.
void require(bool succeeded, const std::string& what) {
  if (!succeeded) {
    throw CertificateError("OpenSSL cannot " + what + ": " + openssl_words());
  }
}

void add_name_part(X509_NAME* name, const char* field, const std::string& text) {
  if (text.empty()) return;
  const auto* const bytes = reinterpret_cast<const unsigned char*>(text.data());
  require(X509_NAME_add_entry_by_txt(name, field, MBSTRING_UTF8, bytes, static_cast<int>(text.size()), -1,
                                     0) == 1,
          "name a certificate for '" + text + "'");
}

void set_subject(X509* certificate, const Subject& subject) {
  X509_NAME* const name = X509_get_subject_name(certificate);
  add_name_part(name, "O", subject.room);
  add_name_part(name, "OU", subject.role);
  add_name_part(name, "CN", subject.name);
}

void set_serial(X509* certificate) {
  const std::unique_ptr<BIGNUM, decltype(&BN_free)> serial(BN_new(), &BN_free);
  require(serial != nullptr && BN_rand(serial.get(), kSerialBits, BN_RAND_TOP_ANY, BN_RAND_BOTTOM_ANY) == 1 &&
              BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(certificate)) != nullptr,
          "draw a serial number");
}

void set_period(X509* certificate, const Period& period) {
  require(ASN1_TIME_set(X509_getm_notBefore(certificate), period.from_s) != nullptr &&
              ASN1_TIME_set(X509_getm_notAfter(certificate), period.until_s) != nullptr,
          "write the times of a certificate");
}

void add_extension(X509* certificate, X509* issuer, int nid, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const OpenSslPtr<X509_EXTENSION> extension(X509V3_EXT_conf_nid(nullptr, &context, nid, value));
  require(extension != nullptr && X509_add_ext(certificate, extension.get(), -1) == 1,
          std::string("add the extension ") + value);
}

/// All but the issuer and the signature.
Certificate unsigned_certificate(const Subject& subject, const PrivateKey& key, const Period& period) {
  Certificate certificate(X509_new());
  require(certificate != nullptr && X509_set_version(certificate.get(), kVersion3) == 1 &&
              X509_set_pubkey(certificate.get(), key.get()) == 1,
          "begin a certificate");
  set_serial(certificate.get());
  set_period(certificate.get(), period);
  set_subject(certificate.get(), subject);
  return certificate;
}

void sign(X509* certificate, X509* issuer, const PrivateKey& key) {
  require(X509_set_issuer_name(certificate, X509_get_subject_name(issuer)) == 1 &&
              X509_sign(certificate, key.get(), EVP_sha256()) > 0,
          "sign a certificate");
}

OpenSslPtr<BIO> memory() {
  OpenSslPtr<BIO> stream(BIO_new(BIO_s_mem()));
  require(stream != nullptr, "get memory");
  return stream;
}

std::string text_of(const OpenSslPtr<BIO>& stream) {
  char* begin = nullptr;
  const long length = BIO_get_mem_data(stream.get(), &begin);
  return {begin, begin + length};
}

}  // namespace

PrivateKey make_private_key() {
  PrivateKey key(EVP_EC_gen("prime256v1"));
  require(key != nullptr, "make a private key");
  return key;
}

Authority make_authority(const Subject& subject, const Period& period) {
  Authority authority{nullptr, make_private_key()};
  authority.certificate = unsigned_certificate(subject, authority.key, period);
  X509* const self = authority.certificate.get();
  add_extension(self, self, NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  add_extension(self, self, NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature");
  add_extension(self, self, NID_subject_key_identifier, "hash");
  sign(self, self, authority.key);
  return authority;
}

Certificate issue_certificate(const Authority& authority, const Subject& subject, const PrivateKey& key,
                              const Period& period) {
  Certificate certificate = unsigned_certificate(subject, key, period);
  X509* const issuer = authority.certificate.get();
  add_extension(certificate.get(), issuer, NID_basic_constraints, "critical,CA:FALSE");
  add_extension(certificate.get(), issuer, NID_key_usage, "critical,digitalSignature");
  add_extension(certificate.get(), issuer, NID_subject_key_identifier, "hash");
  add_extension(certificate.get(), issuer, NID_authority_key_identifier, "keyid:always");
  sign(certificate.get(), issuer, authority.key);
  return certificate;
}

std::string sign_document(const Authority& authority, const std::string& document) {
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_STREAM;
  const OpenSslPtr<BIO> content(BIO_new_mem_buf(document.data(), static_cast<int>(document.size())));
  const OpenSslPtr<PKCS7> signature(
      PKCS7_sign(authority.certificate.get(), authority.key.get(), nullptr, content.get(), kFlags));
  const OpenSslPtr<BIO> result = memory();
  require(
      signature != nullptr && SMIME_write_PKCS7(result.get(), signature.get(), content.get(), kFlags) == 1,
      "sign a document");
  return text_of(result);
}

std::string pem_text(const Certificate& certificate) {
  const OpenSslPtr<BIO> stream = memory();
  require(PEM_write_bio_X509(stream.get(), certificate.get()) == 1, "write a certificate");
  return text_of(stream);
}

std::string pem_text(const PrivateKey& key) {
  const OpenSslPtr<BIO> stream = memory();
  require(PEM_write_bio_PKCS8PrivateKey(stream.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) == 1,
          "write a private key");
  return text_of(stream);
}

}  // namespace tubed
