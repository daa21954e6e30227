// A folder with the keys of one identity, for DDS Security: what its files are called, whose they are, until
// when they are valid, and what is wrong with them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "idl/permissions.hpp"

namespace tubed {

// As `tubectl keys` names them. The authorities' own keys are never in such a folder.
inline constexpr const char* kIdentityCaFile = "identity_ca.pem";
inline constexpr const char* kPermissionsCaFile = "permissions_ca.pem";
inline constexpr const char* kGovernanceFile = "governance.p7s";
inline constexpr const char* kPermissionsFile = "permissions.p7s";
inline constexpr const char* kCertificateFile = "identity.pem";
inline constexpr const char* kPrivateKeyFile = "identity.key";

/// From this age on programs warn that the keys expire soon.
inline constexpr std::int64_t kKeysEndSoonDays = 30;

/// Whose keys they are.
struct KeyHolder {
  std::string name;                ///< common name of the certificate: "daemon", "view-1"
  std::string role;                ///< organizational unit: "daemon", "subscriber"
  std::string room;                ///< organization, as the room's maker named it
  std::int64_t valid_from_s = 0;   ///< of certificate, authority and permissions the latest; since 1970, UTC
  std::int64_t valid_until_s = 0;  ///< of the three the earliest
  Grant grant;
};

/// What was found at the time that was given.
struct KeyExamination {
  std::vector<std::string> problems;  ///< each names the file, says what is wrong and what to do
  std::optional<KeyHolder> holder;    ///< as far as it can be read; expired ones too
};

/// `now_s`: seconds since 1970, UTC. Never throws because of what it finds or misses.
KeyExamination examine_keys(const std::filesystem::path& folder, std::int64_t now_s);

/// Why the holder may not have this access to these topics in `partition`; empty when it may. `folder` is
/// for the words.
std::string refusal_of(const KeyHolder& holder, const std::filesystem::path& folder, Access access,
                       const std::vector<std::string>& topics, const std::string& partition);

/// "valid until 2026-11-23T08:36:21Z, 12 days", "expired 2026-..." or "not valid before 2026-...".
std::string validity_words(const KeyHolder& holder, std::int64_t now_s);

/// Whole days until the keys expire; negative afterwards.
std::int64_t days_left(const KeyHolder& holder, std::int64_t now_s);

}  // namespace tubed
