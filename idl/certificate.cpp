#include "idl/certificate.hpp"

#include <openssl/crypto.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>

#include <array>
#include <cerrno>
#include <ctime>
#include <fstream>
#include <iterator>
#include <system_error>

namespace tubed {
namespace {

// Cyclone's threads encrypt until the process is gone, and exit() takes OpenSSL down under them: a crash in
// every second program that ends. So OpenSSL is told not to tidy up at the end, before anybody's main() has
// used it.
[[maybe_unused]] const int kOpensslStaysUntilTheEnd = OPENSSL_init_crypto(OPENSSL_INIT_NO_ATEXIT, nullptr);

constexpr const char* kCopyAll =
    "copy all files of the identity's folder, as `tubectl keys` made it, to this place";

OpenSslPtr<BIO> stream_of(const std::string& text) {
  return OpenSslPtr<BIO>(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

std::string text_of(BIO* stream) {
  char* begin = nullptr;
  const long length = BIO_get_mem_data(stream, &begin);
  return {begin, begin + length};
}

/// Nobody sits at the terminal of a service: a key with a password is an error, not a question.
int no_password(char*, int, int, void*) { return 0; }

std::int64_t seconds_of(const ASN1_TIME* time) {
  std::tm parts{};
  ASN1_TIME_to_tm(time, &parts);
  return timegm(&parts);
}

}  // namespace

std::string openssl_words() {
  std::array<char, 256> words{};
  const unsigned long code = ERR_peek_last_error();
  ERR_clear_error();
  ERR_error_string_n(code, words.data(), words.size());
  return code == 0 ? "no reason given" : words.data();
}

std::string file_text(const std::filesystem::path& file) {
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (stream.is_open() && !stream.bad() && !text.empty()) {
    return text;
  }
  const int error = errno;
  if (stream.is_open() && error == 0) {
    throw CertificateError(file.string() + ": is empty: " + kCopyAll);
  }
  if (error == EACCES) {
    throw CertificateError(file.string() +
                           ": may not be read by this user: for a service `chown root:tubed` and `chmod "
                           "0640`, for a person `chown` to that person and `chmod 0600`");
  }
  throw CertificateError(file.string() + ": cannot be read (" + std::generic_category().message(error) +
                         "): " + kCopyAll);
}

Certificate read_certificate(const std::filesystem::path& file) {
  const std::string text = file_text(file);
  Certificate certificate(PEM_read_bio_X509(stream_of(text).get(), nullptr, no_password, nullptr));
  if (certificate == nullptr) {
    throw CertificateError(file.string() + ": is no certificate in PEM form (" + openssl_words() +
                           "): " + kCopyAll);
  }
  return certificate;
}

PrivateKey read_private_key(const std::filesystem::path& file) {
  const std::string text = file_text(file);
  PrivateKey key(PEM_read_bio_PrivateKey(stream_of(text).get(), nullptr, no_password, nullptr));
  if (key == nullptr) {
    throw CertificateError(file.string() + ": is no private key in PEM form without a password (" +
                           openssl_words() + "): " + kCopyAll);
  }
  return key;
}

std::string read_signed_document(const std::filesystem::path& file, const Certificate& authority) {
  const std::string text = file_text(file);
  BIO* content = nullptr;
  const OpenSslPtr<PKCS7> document(SMIME_read_PKCS7(stream_of(text).get(), &content));
  const OpenSslPtr<BIO> owned_content(content);
  if (document == nullptr) {
    throw CertificateError(file.string() + ": is no signed document, S/MIME (" + openssl_words() +
                           "): " + kCopyAll);
  }
  const OpenSslPtr<BIO> result(BIO_new(BIO_s_mem()));
  const OpenSslPtr<STACK_OF(X509)> signers(sk_X509_new_null());
  sk_X509_push(signers.get(), authority.get());
  // The authority itself has to have signed it; the authority's own issuer is not checked.
  constexpr int kFlags = PKCS7_TEXT | PKCS7_NOVERIFY | PKCS7_NOINTERN;
  if (PKCS7_verify(document.get(), signers.get(), nullptr, content, result.get(), kFlags) != 1) {
    throw CertificateError(file.string() +
                           ": was signed by another authority than permissions_ca.pem, or changed "
                           "afterwards (" +
                           openssl_words() + "): " + kCopyAll);
  }
  return text_of(result.get());
}

bool is_signed_by(const Certificate& certificate, const Certificate& authority) {
  const bool is_signed = X509_check_issued(authority.get(), certificate.get()) == X509_V_OK &&
                         X509_verify(certificate.get(), X509_get0_pubkey(authority.get())) == 1;
  ERR_clear_error();
  return is_signed;
}

bool belong_together(const Certificate& certificate, const PrivateKey& key) {
  const bool is_pair = X509_check_private_key(certificate.get(), key.get()) == 1;
  ERR_clear_error();
  return is_pair;
}

std::int64_t valid_from_s(const Certificate& certificate) {
  return seconds_of(X509_get0_notBefore(certificate.get()));
}

std::int64_t valid_until_s(const Certificate& certificate) {
  return seconds_of(X509_get0_notAfter(certificate.get()));
}

std::string subject_of(const Certificate& certificate) {
  const OpenSslPtr<BIO> stream(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(stream.get(), X509_get_subject_name(certificate.get()), 0, XN_FLAG_RFC2253);
  return text_of(stream.get());
}

std::string subject_part(const Certificate& certificate, int nid) {
  std::array<char, 256> text{};
  X509_NAME_get_text_by_NID(X509_get_subject_name(certificate.get()), nid, text.data(),
                            static_cast<int>(text.size()));
  return text.data();
}

}  // namespace tubed
