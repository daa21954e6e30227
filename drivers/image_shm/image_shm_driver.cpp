#include "drivers/image_shm/image_shm_driver.hpp"

#include <pwd.h>
#include <unistd.h>

#include <array>
#include <stdexcept>

#include "drivers/image_shm/shm_image_source.hpp"

namespace tubed {

namespace {

uid_t id_of_user(const std::string& name) {
  passwd entry{};
  passwd* found = nullptr;
  std::array<char, 4096> words{};
  if (getpwnam_r(name.c_str(), &entry, words.data(), words.size(), &found) != 0 || found == nullptr) {
    throw std::runtime_error("image_shm.user: this system has no user '" + name + "'");
  }
  return entry.pw_uid;
}

}  // namespace

std::vector<SettingDescription> image_shm_settings() {
  SettingDescription user;
  user.name = "user";
  user.default_value = std::string();
  user.meaning = "user the frame grabber's program runs as; empty = root or the daemon's own";
  return {user};
}

std::string image_shm_socket(const std::string& device, const std::string& camera,
                             const std::filesystem::path& folder) {
  return device.empty() ? "/run/tubed/image-" + camera + ".sock"
                        : (folder / device).lexically_normal().string();
}

std::unique_ptr<ImageSource> make_shm_image_source(const RoomDescription& room,
                                                   const DriverSettings& settings, const std::string& socket,
                                                   int camera_index) {
  std::vector<uid_t> trusted{0, geteuid()};
  const auto& user = settings.get<std::string>("user");
  if (!user.empty()) {
    trusted.push_back(id_of_user(user));
  }
  return std::make_unique<ShmImageSource>(room.cameras.at(static_cast<std::size_t>(camera_index)), socket,
                                          trusted);
}

}  // namespace tubed
