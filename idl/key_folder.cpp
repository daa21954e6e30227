#include "idl/key_folder.hpp"

#include <openssl/objects.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>

#include "idl/certificate.hpp"
#include "idl/utc_time.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kByOthers = 07;
constexpr unsigned kWritten = 022;
constexpr const char* kRenew =
    "`tubectl keys renew ROOM` where the room was made, copy the identity's folder here again and restart";

std::string octal(unsigned mode) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "%04o", mode);
  return text.data();
}

/// A private key that others can read is everybody's.
void check_mode(const fs::path& key, std::vector<std::string>& problems) {
  struct stat status {};
  if (::stat(key.c_str(), &status) != 0) return;  // a missing file is reported when it is read
  const unsigned mode = status.st_mode & 07777U;
  if ((mode & (kByOthers | kWritten)) != 0) {
    problems.push_back(key.string() + ": has mode " + octal(mode) +
                       ", so that others may use it: `chmod 0600` (or 0640 with the service's group), and "
                       "make new keys if somebody may have copied it");
  }
}

void check_time(const fs::path& file, std::int64_t from_s, std::int64_t until_s, std::int64_t now_s,
                std::vector<std::string>& problems) {
  if (now_s < from_s) {
    problems.push_back(file.string() + ": is not valid before " + utc_text(from_s) + ", and now it is " +
                       utc_text(now_s) + ": check the clock (`timedatectl`), or " + kRenew);
  }
  if (now_s >= until_s) {
    problems.push_back(file.string() + ": expired " + utc_text(until_s) + ": " + kRenew);
  }
}

/// One examination: each step says what it finds and leaves what the next ones need.
class Examiner {
 public:
  Examiner(fs::path folder, std::int64_t now_s) : folder_(std::move(folder)), now_s_(now_s) {}

  KeyExamination examine() {
    if (!is_folder()) return std::move(found_);
    check_mode(folder_ / kPrivateKeyFile, found_.problems);
    read();
    if (certificate_ != nullptr) {
      found_.holder = KeyHolder{subject_part(certificate_, NID_commonName),
                                subject_part(certificate_, NID_organizationalUnitName),
                                subject_part(certificate_, NID_organizationName),
                                valid_from_s(certificate_),
                                valid_until_s(certificate_),
                                {}};
      check_time(folder_ / kCertificateFile, found_.holder->valid_from_s, found_.holder->valid_until_s,
                 now_s_, found_.problems);
      check_authority();
      check_key();
    }
    check_documents();
    return std::move(found_);
  }

 private:
  bool is_folder() {
    std::error_code error;
    if (fs::is_directory(folder_, error)) return true;
    found_.problems.push_back(folder_.string() + ": " +
                              (error ? "cannot be used (" + error.message() + ")" : "is no folder") +
                              ": give the folder of an identity that `tubectl keys make-room` made");
    return false;
  }

  void attempt(const std::function<void()>& step) {
    try {
      step();
    } catch (const CertificateError& error) {
      found_.problems.emplace_back(error.what());
    }
  }

  void read() {
    attempt([this] { identity_ca_ = read_certificate(folder_ / kIdentityCaFile); });
    attempt([this] { permissions_ca_ = read_certificate(folder_ / kPermissionsCaFile); });
    attempt([this] { certificate_ = read_certificate(folder_ / kCertificateFile); });
    attempt([this] { key_ = read_private_key(folder_ / kPrivateKeyFile); });
  }

  void narrow(std::int64_t from_s, std::int64_t until_s) {
    found_.holder->valid_from_s = std::max(found_.holder->valid_from_s, from_s);
    found_.holder->valid_until_s = std::min(found_.holder->valid_until_s, until_s);
  }

  void check_authority() {
    if (identity_ca_ == nullptr) return;
    const fs::path file = folder_ / kIdentityCaFile;
    narrow(valid_from_s(identity_ca_), valid_until_s(identity_ca_));
    check_time(file, valid_from_s(identity_ca_), valid_until_s(identity_ca_), now_s_, found_.problems);
    if (!is_signed_by(certificate_, identity_ca_)) {
      found_.problems.push_back((folder_ / kCertificateFile).string() + ": was not signed by " +
                                file.string() + ": the files are of two rooms; copy one whole folder");
    }
  }

  void check_key() {
    if (key_ != nullptr && !belong_together(certificate_, key_)) {
      found_.problems.push_back((folder_ / kPrivateKeyFile).string() + ": does not belong to " +
                                (folder_ / kCertificateFile).string() +
                                ": the files are of two identities or from before and after a renewal; copy "
                                "one whole folder");
    }
  }

  void check_documents() {
    if (permissions_ca_ == nullptr) return;
    attempt([this] { read_signed_document(folder_ / kGovernanceFile, permissions_ca_); });
    attempt([this] { check_grant(read_signed_document(folder_ / kPermissionsFile, permissions_ca_)); });
  }

  void check_grant(const std::string& document) {
    if (certificate_ == nullptr) return;
    const fs::path file = folder_ / kPermissionsFile;
    const std::optional<Grant> grant = grant_of(document, subject_of(certificate_));
    if (!grant) {
      found_.problems.push_back(file.string() + ": has no grant for " + subject_of(certificate_) +
                                ": the files are of two identities; copy one whole folder");
      return;
    }
    found_.holder->grant = *grant;
    if (grant->valid_from_s && grant->valid_until_s) {
      narrow(*grant->valid_from_s, *grant->valid_until_s);
      check_time(file, *grant->valid_from_s, *grant->valid_until_s, now_s_, found_.problems);
    }
  }

  fs::path folder_;
  std::int64_t now_s_;
  Certificate identity_ca_;
  Certificate permissions_ca_;
  Certificate certificate_;
  PrivateKey key_;
  KeyExamination found_;
};

std::string quoted(const std::string& partition) {
  return partition.empty() ? "the default partition" : "partition '" + partition + "'";
}

/// The partitions that the grant names for this access, for a message.
std::string partitions_of(const Grant& grant, Access access) {
  std::string words;
  for (const AllowedAccess& allowed : grant.allowed) {
    if (allowed.access != access) continue;
    for (const std::string& partition : allowed.partitions) {
      words += (words.empty() ? "" : ", ") + quoted(partition);
    }
  }
  return words;
}

}  // namespace

KeyExamination examine_keys(const fs::path& folder, std::int64_t now_s) {
  return Examiner(folder, now_s).examine();
}

std::string refusal_of(const KeyHolder& holder, const fs::path& folder, Access access,
                       const std::vector<std::string>& topics, const std::string& partition) {
  for (const std::string& topic : topics) {
    if (allows(holder.grant, access, topic, partition)) continue;
    const std::string verb = access == Access::kPublish ? "publish" : "read";
    const std::string where = partitions_of(holder.grant, access);
    return (folder / kPermissionsFile).string() + ": does not let " + holder.name + " " + verb + " " + topic +
           " in " + quoted(partition) + " (" +
           (where.empty() ? "its role, " + holder.role + ", may not " + verb + " at all"
                          : "it may in " + where) +
           "): use the keys of that room and role, or change the partition";
  }
  return "";
}

std::int64_t days_left(const KeyHolder& holder, std::int64_t now_s) {
  const std::int64_t left_s = holder.valid_until_s - now_s;
  return left_s >= 0 ? left_s / kSecondsPerDay : -((-left_s + kSecondsPerDay - 1) / kSecondsPerDay);
}

std::string validity_words(const KeyHolder& holder, std::int64_t now_s) {
  if (now_s >= holder.valid_until_s) {
    return "expired " + utc_text(holder.valid_until_s);
  }
  if (now_s < holder.valid_from_s) {
    return "not valid before " + utc_text(holder.valid_from_s);
  }
  return "valid until " + utc_text(holder.valid_until_s) + ", " + std::to_string(days_left(holder, now_s)) +
         " days";
}

}  // namespace tubed
