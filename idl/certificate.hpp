// Certificates, keys and signed documents, read with OpenSSL. DDS Security 1.1 Sec. 9.3 and 9.4 say what they
// are.
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

namespace tubed {

/// What is wrong with a certificate, a key or a document, with the file's name and what to do.
class CertificateError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct OpenSslDeleter {
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
  void operator()(BIO* stream) const { BIO_free_all(stream); }
  void operator()(PKCS7* document) const { PKCS7_free(document); }
  void operator()(X509_EXTENSION* extension) const { X509_EXTENSION_free(extension); }
  void operator()(STACK_OF(X509) * certificates) const { sk_X509_free(certificates); }
};
template <typename T>
using OpenSslPtr = std::unique_ptr<T, OpenSslDeleter>;

using Certificate = OpenSslPtr<X509>;
using PrivateKey = OpenSslPtr<EVP_PKEY>;

/// OpenSSL's newest complaint of this thread in words, and forgets them all.
std::string openssl_words();

/// A whole file. Throws CertificateError: it is missing, or may not be read.
std::string file_text(const std::filesystem::path& file);

/// Of a PEM file. Throw CertificateError. A key with a password is refused: nobody is there to type it.
Certificate read_certificate(const std::filesystem::path& file);
PrivateKey read_private_key(const std::filesystem::path& file);

/// The document in an S/MIME file (DDS Security 1.1 Sec. 9.4.1.1) that `authority` signed.
/// Throws CertificateError: no S/MIME file, or signed by somebody else, or changed afterwards.
std::string read_signed_document(const std::filesystem::path& file, const Certificate& authority);

bool is_signed_by(const Certificate& certificate, const Certificate& authority);
bool belong_together(const Certificate& certificate, const PrivateKey& key);

/// Seconds since 1970, UTC.
std::int64_t valid_from_s(const Certificate& certificate);
std::int64_t valid_until_s(const Certificate& certificate);

/// "CN=daemon,OU=daemon,O=tubed", as RFC 2253 orders and escapes it.
std::string subject_of(const Certificate& certificate);
/// One part of the subject: NID_commonName, ...; empty when there is none.
std::string subject_part(const Certificate& certificate, int nid);

}  // namespace tubed
