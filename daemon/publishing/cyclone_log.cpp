#include "daemon/publishing/cyclone_log.hpp"

#include <dds/ddsrt/log.h>

#include <algorithm>
#include <chrono>
#include <mutex>

namespace tubed {

namespace {

constexpr int kMessages = 5;
constexpr std::int64_t kPeriod_ns = 10'000'000'000;
constexpr std::size_t kLongest = 300;

struct Route {
  std::mutex one_at_a_time;
  MessageLimit limit{kMessages, kPeriod_ns};
  void (*say)(std::string_view) = nullptr;
};

void hand_on(void* route_pointer, const dds_log_data_t* data) {
  auto& route = *static_cast<Route*>(route_pointer);
  const std::scoped_lock lock(route.one_at_a_time);
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  const std::string_view message(data->message, data->size);
  if (const auto words =
          route.limit.admit(message, std::chrono::duration_cast<std::chrono::nanoseconds>(now).count())) {
    route.say(*words);
  }
}

std::string in_one_line(std::string_view message) {
  while (!message.empty() && (message.back() == '\n' || message.back() == ' ')) message.remove_suffix(1);
  std::string line(message.substr(0, kLongest));
  std::replace(line.begin(), line.end(), '\n', ' ');
  return message.size() > kLongest ? line + " ..." : line;
}

}  // namespace

std::optional<std::string> MessageLimit::admit(std::string_view message, std::int64_t now_ns) {
  if (!period_began_ns_ || now_ns - *period_began_ns_ >= period_ns_) {
    period_began_ns_ = now_ns;
    admitted_ = 0;
  }
  if (admitted_ >= messages_a_period_) {
    ++withheld_;
    return std::nullopt;
  }
  ++admitted_;
  std::string words = in_one_line(message);
  if (withheld_ > 0) words += " (and " + std::to_string(withheld_) + " messages before it)";
  withheld_ = 0;
  return words;
}

void route_cyclone_log(void (*say)(std::string_view)) {
  static Route route;  // Cyclone may still speak while the process ends
  route.say = say;
  dds_set_log_sink(&hand_on, &route);
}

}  // namespace tubed
