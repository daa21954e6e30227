// The viewer as a whole: feeds in, server out.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "clients/cpp/subscription.hpp"
#include "clients/view/demo_commands.hpp"
#include "clients/view/image_feed.hpp"
#include "clients/view/room_feed.hpp"
#include "clients/view/web_server.hpp"

namespace tubed {

struct ViewSettings {
  Subscription subscription;
  WebServerSettings server;
  std::filesystem::path image_folder;  ///< of the daemon's previews, preview-NAME.sock; empty: no images
  std::map<std::string, std::string> image_sockets;  ///< by camera: a grabber's own socket instead
  std::filesystem::path demo_folder;  ///< of the control sockets of a simulation; empty: no demonstration
  std::vector<std::string> demo_cameras;
};

/// Made, run and destroyed by the main thread.
class View {
 public:
  static constexpr std::size_t kMaxCameras = 8;

  /// Throws DdsError, std::system_error.
  explicit View(ViewSettings settings);

  /// Until stop().
  void run() { server_.run(); }
  /// Any thread.
  void stop() { server_.stop(); }

 private:
  void hear(std::string_view words);
  std::vector<std::string> show_images(const std::vector<std::string>& cameras);
  [[nodiscard]] std::string socket_of(const std::string& camera) const;

  ViewSettings settings_;
  std::vector<DemoCommand> commands_;
  std::atomic<std::uint64_t> number_{0};
  WebServer server_;
  std::map<std::string, std::unique_ptr<ImageFeed>> images_;  ///< of the room feed's thread, which ends first
  RoomFeed room_;
};

}  // namespace tubed
