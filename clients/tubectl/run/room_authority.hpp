// The two authorities of a room, which say who somebody is and what he may do, and what they sign. All of it
// is OpenSSL's work: elliptic curve prime256v1, SHA-256, X.509 version 3, S/MIME.
#pragma once

#include <filesystem>
#include <string>

#include "clients/tubectl/run/room_documents.hpp"
#include "idl/certificate.hpp"

namespace tubed {

/// A certificate that may sign others and its private key.
struct Authority {
  Certificate certificate;
  PrivateKey key;
};

/// Who a certificate is for; each at most 64 characters (X.509's upper bound of a name).
struct Subject {
  std::string room;  ///< organization
  std::string role;  ///< organizational unit; empty for an authority
  std::string name;  ///< common name
};

/// Throw CertificateError, with OpenSSL's words, when OpenSSL refuses.
PrivateKey make_private_key();
Authority make_authority(const Subject& subject, const Period& period);
Certificate issue_certificate(const Authority& authority, const Subject& subject, const PrivateKey& key,
                              const Period& period);
/// S/MIME, the document readable in it: `openssl smime -sign -text`.
std::string sign_document(const Authority& authority, const std::string& document);

std::string pem_text(const Certificate& certificate);
std::string pem_text(const PrivateKey& key);  ///< PKCS #8, without a password

}  // namespace tubed
