// The folder in which the keys of a room are made and kept:
//
//   FOLDER/room-maker/   the two authorities with their private keys: stays here, on a machine of its maker
//   FOLDER/daemon/       an identity, as idl/key_folder.hpp names its files: copied to where it is used
//   FOLDER/subscriber/   another
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/tubectl/run/room_documents.hpp"
#include "idl/key_folder.hpp"

namespace tubed {

/// What stands in the way of making keys, and what to do.
class RoomError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr const char* kRoomMakerFolder = "room-maker";
/// Authorities are valid far longer than the identities that they sign: a new authority means new keys for
/// the whole room.
inline constexpr std::int64_t kAuthorityDays = 3650;
/// Keys are valid from a day before they are made: clocks of an operating room differ.
inline constexpr std::int64_t kBackdatedDays = 1;

/// From kBackdatedDays before `now_s` for `days`.
Period period_of(std::int64_t now_s, std::int64_t days);

/// Makes `folder` with authorities and the identities "daemon" and "subscriber". `partition`: as [dds]
/// partition, letters, digits, blanks and ._-, at most 64; empty: the default partition. Private keys get
/// mode 0600, their folders 0700. Throws RoomError: `folder` exists and is not empty, names, times.
void make_room(const std::filesystem::path& folder, const std::string& partition, const Period& period);

/// One more identity, in `folder`/`name`. Throws RoomError: no room there, the name is taken.
void add_identity(const std::filesystem::path& folder, Role role, const std::string& name,
                  const Period& period);

/// New keys, certificate and permissions for the identity of that name, or of all with that role, or of all
/// when empty; each takes the place of the old one when it is complete. Returns their names. Throws
/// RoomError.
std::vector<std::string> renew_identities(const std::filesystem::path& folder, const std::string& which,
                                          const Period& period);

/// What `keys show` says of one identity.
struct ListedIdentity {
  std::filesystem::path folder;
  KeyExamination found;
};

/// Of a room: all its identities by name; of an identity's folder: that one. Throws RoomError: neither.
std::vector<ListedIdentity> identities_in(const std::filesystem::path& folder, std::int64_t now_s);

}  // namespace tubed
