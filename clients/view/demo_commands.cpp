#include "clients/view/demo_commands.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

namespace tubed {

namespace {

bool send_order(const DemoOrder& order, const std::filesystem::path& folder) {
  const std::string path = (folder / (order.source + ".sock")).string();
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return false;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const int sender = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (sender < 0) return false;
  const ssize_t sent = sendto(sender, order.words.data(), order.words.size(), MSG_DONTWAIT,
                              reinterpret_cast<const sockaddr*>(&address), sizeof address);
  close(sender);
  return sent == static_cast<ssize_t>(order.words.size());
}

}  // namespace

std::vector<DemoCommand> demo_commands(const std::vector<std::string>& cameras) {
  const auto to_images = [&](const std::string& words) {
    std::vector<DemoOrder> orders;
    for (const std::string& camera : cameras) orders.push_back({"image-" + camera, words});
    return orders;
  };
  std::vector<DemoOrder> clear = to_images("clear");
  clear.push_back({"em", "clear"});
  return {{"off", "Fluoroscopy off", to_images("off")},
          {"image-stall", "Images stall", to_images("stall 3.0")},
          {"black", "Black images", to_images("black")},
          {"pan", "Pan table by 5 mm", to_images("pan 5")},
          {"pan-back", "Pan it back", to_images("pan 0")},
          {"lose-coil", "Break coil 2", {{"em", "lose-coil 2"}}},
          {"outlier", "Coil 3 off by 12 mm", {{"em", "outlier 3 12"}}},
          {"em-stall", "Tracker stalls", {{"em", "stall 3.0"}}},
          {"clear", "Repair all", clear}};
}

const DemoCommand* pressed_command(std::string_view words, const std::vector<DemoCommand>& commands) {
  const nlohmann::json press = nlohmann::json::parse(words, nullptr, false);
  if (!press.is_object() || !press.contains("press") || !press["press"].is_string()) return nullptr;
  const auto& name = press["press"].get_ref<const std::string&>();
  const auto found =
      std::find_if(commands.begin(), commands.end(), [&](const auto& each) { return each.name == name; });
  return found == commands.end() ? nullptr : &*found;
}

bool send_command(const DemoCommand& command, const std::filesystem::path& folder) {
  bool is_taken = true;
  for (const DemoOrder& order : command.orders) is_taken = send_order(order, folder) && is_taken;
  return is_taken;
}

}  // namespace tubed
