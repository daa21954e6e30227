#include "clients/tubectl/run/room_keys.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <system_error>

#include "clients/tubectl/run/room_authority.hpp"
#include "idl/utc_time.hpp"

namespace tubed {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIdentityCaKey = "identity_ca.key";
constexpr const char* kPermissionsCaKey = "permissions_ca.key";
constexpr const char* kPartitionFile = "partition";
constexpr ::mode_t kPrivate = 0600;
constexpr ::mode_t kPublic = 0644;
constexpr std::size_t kMaxNameBytes = 64;  // X.509's upper bound of a name
constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";

/// What every identity of a room is made from.
struct Room {
  Authority identity_authority;
  Authority permissions_authority;
  std::string partition;
};

void check_name(const std::string& name) {
  if (name.empty() || name.size() > kMaxNameBytes || name.front() == '.' || name == kRoomMakerFolder ||
      name.find_first_not_of(kLetters) != std::string::npos) {
    throw RoomError("'" + name + "' is no name for an identity: 1 to 64 letters, digits and ._- , not " +
                    kRoomMakerFolder);
  }
}

void check_partition(const std::string& partition) {
  if (partition.size() > kMaxNameBytes ||
      partition.find_first_not_of(std::string(kLetters) + " ") != std::string::npos) {
    throw RoomError("'" + partition + "' is no name for a room: at most 64 letters, digits, blanks and ._-");
  }
}

void check_period(const Period& period, const Authority& authority) {
  if (period.until_s <= period.from_s) {
    throw RoomError("keys that end " + utc_text(period.until_s) +
                    " would never be valid: ask for a later end");
  }
  if (period.until_s > valid_until_s(authority.certificate)) {
    throw RoomError("the room's authority ends " + utc_text(valid_until_s(authority.certificate)) +
                    ", before the keys would: ask for fewer days, or make a new room");
  }
}

void write_file(const fs::path& file, const std::string& text, ::mode_t mode) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  const bool written = descriptor >= 0 && ::fchmod(descriptor, mode) == 0 &&
                       ::write(descriptor, text.data(), text.size()) == static_cast<::ssize_t>(text.size()) &&
                       ::fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!written) {
    throw RoomError("cannot write " + file.string() + ": " + std::generic_category().message(error));
  }
}

void make_private_folder(const fs::path& folder) {
  if (::mkdir(folder.c_str(), 0700) != 0) {
    throw RoomError("cannot make " + folder.string() + ": " + std::generic_category().message(errno));
  }
}

Room read_room(const fs::path& folder) {
  const fs::path maker = folder / kRoomMakerFolder;
  std::error_code error;
  if (!fs::is_directory(maker, error)) {
    throw RoomError(folder.string() + " is no room: it has no folder " + kRoomMakerFolder +
                    " with the authorities' keys; `tubectl keys make-room` makes one");
  }
  Room room{{read_certificate(maker / kIdentityCaFile), read_private_key(maker / kIdentityCaKey)},
            {read_certificate(maker / kPermissionsCaFile), read_private_key(maker / kPermissionsCaKey)},
            file_text(maker / kPartitionFile)};
  room.partition.erase(room.partition.find_last_not_of('\n') + 1);
  return room;
}

std::string organization_of(const Room& room) { return room.partition.empty() ? "tubed" : room.partition; }

/// All files of an identity, in a folder that is new.
void write_identity(const fs::path& folder, const fs::path& maker, const Room& room, Role role,
                    const std::string& name, const Period& period) {
  const PrivateKey key = make_private_key();
  const Subject subject{organization_of(room), std::string(name_of(role)), name};
  const Certificate certificate = issue_certificate(room.identity_authority, subject, key, period);
  const std::string permissions = permissions_document(role, subject_of(certificate), room.partition, period);
  make_private_folder(folder);
  write_file(folder / kIdentityCaFile, pem_text(room.identity_authority.certificate), kPublic);
  write_file(folder / kPermissionsCaFile, pem_text(room.permissions_authority.certificate), kPublic);
  write_file(folder / kGovernanceFile, file_text(maker / kGovernanceFile), kPublic);
  write_file(folder / kPermissionsFile, sign_document(room.permissions_authority, permissions), kPublic);
  write_file(folder / kCertificateFile, pem_text(certificate), kPublic);
  write_file(folder / kPrivateKeyFile, pem_text(key), kPrivate);
}

void write_authorities(const fs::path& maker, const Room& room) {
  make_private_folder(maker);
  write_file(maker / kIdentityCaFile, pem_text(room.identity_authority.certificate), kPublic);
  write_file(maker / kIdentityCaKey, pem_text(room.identity_authority.key), kPrivate);
  write_file(maker / kPermissionsCaFile, pem_text(room.permissions_authority.certificate), kPublic);
  write_file(maker / kPermissionsCaKey, pem_text(room.permissions_authority.key), kPrivate);
  write_file(maker / kGovernanceFile, sign_document(room.permissions_authority, governance_document()),
             kPublic);
  write_file(maker / kPartitionFile, room.partition + "\n", kPublic);
}

/// The new identity is complete before the old one goes.
void replace_folder(const fs::path& fresh, const fs::path& place) {
  const fs::path old = place.parent_path() / ("." + place.filename().string() + ".old");
  fs::remove_all(old);
  fs::rename(place, old);
  fs::rename(fresh, place);
  fs::remove_all(old);
}

bool is_identity(const fs::path& folder) {
  std::error_code error;
  return fs::exists(folder / kCertificateFile, error);
}

std::vector<fs::path> identity_folders(const fs::path& room) {
  std::vector<fs::path> folders;
  for (const fs::directory_entry& entry : fs::directory_iterator(room)) {
    if (entry.path().filename().string().front() != '.' && is_identity(entry.path())) {
      folders.push_back(entry.path());
    }
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

}  // namespace

Period period_of(std::int64_t now_s, std::int64_t days) {
  return {now_s - kBackdatedDays * kSecondsPerDay, now_s + days * kSecondsPerDay};
}

void make_room(const fs::path& folder, const std::string& partition, const Period& period) {
  check_partition(partition);
  std::error_code error;
  if (fs::exists(folder, error) && !(fs::is_directory(folder, error) && fs::is_empty(folder, error))) {
    throw RoomError(folder.string() +
                    " is there already: keys are never overwritten; name a new folder, or "
                    "`tubectl keys renew` what is in it");
  }
  const Period for_authorities{period.from_s,
                               std::max(period.from_s + kAuthorityDays * kSecondsPerDay, period.until_s)};
  Room room{{}, {}, partition};
  const std::string organization = organization_of(room);
  room.identity_authority = make_authority({organization, "", "identity authority"}, for_authorities);
  room.permissions_authority = make_authority({organization, "", "permissions authority"}, for_authorities);
  check_period(period, room.identity_authority);
  if (!fs::exists(folder, error)) make_private_folder(folder);
  write_authorities(folder / kRoomMakerFolder, room);
  for (const Role role : {Role::kDaemon, Role::kSubscriber}) {
    add_identity(folder, role, std::string(name_of(role)), period);
  }
}

void add_identity(const fs::path& folder, Role role, const std::string& name, const Period& period) {
  check_name(name);
  const Room room = read_room(folder);
  check_period(period, room.identity_authority);
  std::error_code error;
  if (fs::exists(folder / name, error)) {
    throw RoomError((folder / name).string() +
                    " is there already: choose another name, or `tubectl keys renew " + folder.string() +
                    " " + name + "`");
  }
  write_identity(folder / name, folder / kRoomMakerFolder, room, role, name, period);
}

std::vector<std::string> renew_identities(const fs::path& folder, const std::string& which,
                                          const Period& period) {
  const Room room = read_room(folder);
  check_period(period, room.identity_authority);
  std::vector<std::string> renewed;
  for (const fs::path& place : identity_folders(folder)) {
    const Certificate before = read_certificate(place / kCertificateFile);
    const std::string role_name = subject_part(before, NID_organizationalUnitName);
    const std::string name = place.filename().string();
    const std::optional<Role> role = role_named(role_name);
    if (!role || (!which.empty() && which != name && which != role_name)) continue;
    const fs::path fresh = folder / ("." + name + ".new");
    fs::remove_all(fresh);
    write_identity(fresh, folder / kRoomMakerFolder, room, *role, name, period);
    replace_folder(fresh, place);
    renewed.push_back(name);
  }
  if (renewed.empty()) {
    throw RoomError(folder.string() + " has no identity '" + which + "': `tubectl keys show " +
                    folder.string() + "` lists them");
  }
  return renewed;
}

std::vector<ListedIdentity> identities_in(const fs::path& folder, std::int64_t now_s) {
  std::error_code error;
  std::vector<fs::path> folders;
  if (is_identity(folder)) {
    folders.push_back(folder);
  } else if (fs::is_directory(folder, error)) {
    folders = identity_folders(folder);
  }
  if (folders.empty()) {
    throw RoomError(folder.string() +
                    " holds no keys: give a room of `tubectl keys make-room`, or the folder of "
                    "one identity");
  }
  std::vector<ListedIdentity> listed;
  for (const fs::path& identity : folders) {
    listed.push_back({identity, examine_keys(identity, now_s)});
  }
  return listed;
}

}  // namespace tubed
