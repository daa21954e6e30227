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

std::vector<KeyDescription> image_shm_settings() {
  return {key::text("user", "", {.is_user = true},
                    "user the frame grabber's program runs as; empty = root or the daemon's own")};
}

DriverDescription image_shm_driver() {
  DriverDescription driver{
      "image_shm",
      "images of a frame grabber's program on this machine, through shared memory",
      Origin::kDevice,
      image_shm_settings(),
      {},
      [](const SourceContext& context, int camera_index) {
        const CameraCalibration& camera = context.room.cameras.at(static_cast<std::size_t>(camera_index));
        return make_shm_image_source(
            context.room, context.settings,
            image_shm_socket(context.device, camera.name, context.configuration_folder), camera_index);
      }};
  driver.device_socket = image_shm_socket;
  return driver;
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
