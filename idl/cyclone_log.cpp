#include "idl/cyclone_log.hpp"

#include <dds/ddsrt/log.h>

#include <algorithm>
#include <mutex>

#include "idl/printable_text.hpp"

namespace tubed {

namespace {

constexpr int kMessages = 5;
constexpr std::int64_t kPeriod_ns = 10'000'000'000;
constexpr std::size_t kMaxLineBytes = 300;
// As Cyclone 0.10 begins what it says of a packet that it cannot read.
constexpr std::string_view kMalformed = "malformed packet";

struct Route {
  std::mutex one_at_a_time;
  MessageLimit limit{kMessages, kPeriod_ns};
  CycloneListener listener;
  CycloneLogCounters counters;
};

/// Of the process, as Cyclone's sink is; Cyclone may still speak while the process ends.
Route& route() {
  static Route route;
  return route;
}

void hand_on(void* route_pointer, const dds_log_data_t* data) {
  auto& route = *static_cast<Route*>(route_pointer);
  const std::scoped_lock lock(route.one_at_a_time);
  const std::string_view message(data->message, data->size);
  ++route.counters.messages;
  route.counters.malformed_packets += message.find(kMalformed) == std::string_view::npos ? 0 : 1;
  if (const auto words = route.limit.admit(message, route.listener.monotonic_ns())) {
    route.listener.say(*words);
  }
}

void listen() {
  const bool has_listener = route().listener.say != nullptr;
  dds_set_log_sink(has_listener ? &hand_on : nullptr, has_listener ? &route() : nullptr);
}

void collect(void* words, const dds_log_data_t* line) {
  const std::scoped_lock lock(route().one_at_a_time);
  static_cast<std::string*>(words)->append(line->message, line->size);
}

std::string in_one_line(std::string_view message) {
  while (!message.empty() && (message.back() == '\n' || message.back() == ' ')) message.remove_suffix(1);
  std::string line(message);
  std::replace(line.begin(), line.end(), '\n', ' ');
  line = printable_text(line);
  return line.size() > kMaxLineBytes ? printable_text(line, kMaxLineBytes) + " ..." : line;
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

void route_cyclone_log(CycloneListener listener) {
  route().listener = listener;
  listen();
}

CycloneLogCounters cyclone_log_counters() {
  const std::scoped_lock lock(route().one_at_a_time);
  return route().counters;
}

CapturedCycloneLog::CapturedCycloneLog() { dds_set_log_sink(&collect, &words_); }
CapturedCycloneLog::~CapturedCycloneLog() { listen(); }
std::string CapturedCycloneLog::words() const {
  const std::scoped_lock lock(route().one_at_a_time);
  return in_one_line(words_);
}

}  // namespace tubed
