#include "daemon/config/surroundings.hpp"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <set>
#include <system_error>

#include "idl/printable_text.hpp"

namespace tubed {

namespace {

constexpr std::size_t kEntryBytes = std::size_t{1} << 16U;
constexpr std::size_t kMaxSocketPath = sizeof(sockaddr_un::sun_path) - 1;

bool is_group(const std::string& name) {
  group entry{};
  group* found = nullptr;
  std::vector<char> words(kEntryBytes);
  return getgrnam_r(name.c_str(), &entry, words.data(), words.size(), &found) == 0 && found != nullptr;
}

bool is_user(const std::string& name) {
  passwd entry{};
  passwd* found = nullptr;
  std::vector<char> words(kEntryBytes);
  return getpwnam_r(name.c_str(), &entry, words.data(), words.size(), &found) == 0 && found != nullptr;
}

std::string own_name() {
  passwd entry{};
  passwd* found = nullptr;
  std::vector<char> words(kEntryBytes);
  const bool is_known =
      getpwuid_r(geteuid(), &entry, words.data(), words.size(), &found) == 0 && found != nullptr;
  return is_known ? "user '" + std::string(entry.pw_name) + "'" : "user " + std::to_string(geteuid());
}

/// Why nobody can connect to a socket of that path; empty: one can.
std::string path_fault(const std::string& path) {
  return path.size() <= kMaxSocketPath ? ""
                                       : "expected a path of at most " + std::to_string(kMaxSocketPath) +
                                             " bytes, which is as long as that of a "
                                             "socket can be, found one of " +
                                             std::to_string(path.size());
}

/// Why a socket cannot be made there; empty: it can.
std::string place_fault(const std::string& path) {
  if (std::string fault = path_fault(path); !fault.empty()) return fault;
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const std::string shown = "folder '" + printable_text(folder) + "'";
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0) {
    return shown + " of the socket: " + std::generic_category().message(errno) +
           "; make it, or choose one that is there (systemd makes /run/tubed when the service starts)";
  }
  if (!S_ISDIR(status.st_mode)) return shown + " of the socket is no folder";
  if (faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0) {
    return shown + " of the socket cannot be written by " + own_name() +
           ", the user that this runs as: " + std::generic_category().message(errno);
  }
  return "";
}

void add_at(const CheckedTable& table, const std::string& key, std::string message, Problems& problems) {
  problems.push_back({table.at(key).position, table.path_of(key), std::move(message)});
}

void check_place(const CheckedTable& shm, const std::string& key, const std::filesystem::path& socket,
                 Problems& problems) {
  if (const std::string fault = place_fault(socket.lexically_normal().string()); !fault.empty()) {
    add_at(shm, key, fault, problems);
  }
}

void check_shm(const CheckedTable& file, const std::filesystem::path& folder, Problems& problems) {
  const CheckedTable& shm = file.one("shm");
  const auto& socket = shm.get<std::string>("estimates_socket");
  const auto& previews = shm.get<std::string>("preview_folder");
  if (socket.empty() && previews.empty()) return;
  if (!socket.empty()) check_place(shm, "estimates_socket", folder / socket, problems);
  if (!previews.empty()) {
    std::size_t longest = 0;
    for (const CheckedTable& camera : file.many("camera")) {
      longest = std::max(longest, camera.get<std::string>("name").size());
    }
    check_place(shm, "preview_folder", folder / previews / ("preview-" + std::string(longest, 'x') + ".sock"),
                problems);
  }
  const auto& name = shm.get<std::string>("group");
  if (!name.empty() && !is_group(name)) {
    add_at(shm, "group", "this system has no group '" + name + "'; `getent group` lists them", problems);
  }
}

void check_users(const CheckedTable& table, const DriverDescription& driver, Problems& problems) {
  for (const KeyDescription& setting : driver.settings) {
    if (!setting.text.is_user) continue;
    const auto& name = table.get<std::string>(setting.name);
    if (!name.empty() && !is_user(name)) {
      add_at(table, setting.name, "this system has no user '" + name + "'; `getent passwd` lists them",
             problems);
    }
  }
}

}  // namespace

void check_surroundings(const CheckedTable& file, const std::filesystem::path& folder,
                        const std::vector<DriverDescription>& available, Problems& problems) {
  check_shm(file, folder, problems);
  std::set<const DriverDescription*> used{find_driver(available, file.one("em").get<std::string>("driver"))};
  for (const CheckedTable& camera : file.many("camera")) {
    const DriverDescription* const driver = find_driver(available, camera.get<std::string>("driver"));
    used.insert(driver);
    if (driver == nullptr || !driver->device_socket) continue;
    const std::string path =
        driver->device_socket(camera.get<std::string>("device"), camera.get<std::string>("name"), folder);
    if (const std::string fault = path_fault(path); !fault.empty()) add_at(camera, "device", fault, problems);
  }
  for (const DriverDescription* const driver : used) {
    if (driver != nullptr) check_users(file.one(driver->name), *driver, problems);
  }
}

}  // namespace tubed
