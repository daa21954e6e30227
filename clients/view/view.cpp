#include "clients/view/view.hpp"

#include <algorithm>
#include <iostream>
#include <utility>

namespace tubed {

namespace {

/// What may stand in the name of a socket: a name comes over the network.
bool is_file_name(const std::string& camera) {
  return !camera.empty() && camera.front() != '.' &&
         std::all_of(camera.begin(), camera.end(), [](unsigned char letter) {
           return std::isalnum(letter) != 0 || letter == '-' || letter == '_' || letter == '.';
         });
}

RoomKnowledge known_from_the_start(const ViewSettings& settings, const std::vector<DemoCommand>& commands) {
  RoomKnowledge known;
  known.demo_commands = commands;
  known.files = settings.server.files;
  return known;
}

}  // namespace

View::View(ViewSettings settings)
    : settings_(std::move(settings)),
      commands_(settings_.demo_folder.empty() ? std::vector<DemoCommand>()
                                              : demo_commands(settings_.demo_cameras)),
      server_(settings_.server, [this](std::string_view words) { hear(words); }),
      room_(settings_.subscription, known_from_the_start(settings_, commands_),
            {.next_number = [this] { return ++number_; },
             .publish = [this](SharedMessage message) { server_.publish(std::move(message)); },
             .shown_cameras =
                 [this](const std::vector<std::string>& cameras) { return show_images(cameras); }}) {}

void View::hear(std::string_view words) {
  const DemoCommand* const command = pressed_command(words, commands_);
  if (command != nullptr && !send_command(*command, settings_.demo_folder)) {
    std::cerr << "tubed-view: the simulation does not take \"" << command->label << "\"\n";
  }
}

std::string View::socket_of(const std::string& camera) const {
  const auto own = settings_.image_sockets.find(camera);
  if (own != settings_.image_sockets.end()) return own->second;
  const bool has_preview = !settings_.image_folder.empty() && is_file_name(camera);
  return has_preview ? (settings_.image_folder / ("preview-" + camera + ".sock")).string() : "";
}

std::vector<std::string> View::show_images(const std::vector<std::string>& cameras) {
  std::vector<std::string> shown;
  for (const std::string& camera : cameras) {
    const std::string socket = socket_of(camera);
    const bool is_known = images_.contains(camera);
    if (socket.empty() || (!is_known && images_.size() >= kMaxCameras)) continue;
    shown.push_back(camera);
    if (is_known) continue;
    images_[camera] = std::make_unique<ImageFeed>(
        ImageFeedSettings{.camera = camera, .socket = socket}, [this] { return ++number_; },
        [this](SharedMessage message) { server_.publish(std::move(message)); },
        [this] { return server_.tabs() > 0; });
  }
  return shown;
}

}  // namespace tubed
