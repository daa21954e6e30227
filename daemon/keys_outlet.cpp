#include "daemon/keys_outlet.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>

#include "daemon/publishing/clock_pair.hpp"

namespace tubed {

namespace {

std::int64_t seconds_since_1970() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::seconds>(now).count();
}

StageState state_at(const KeyHolder& holder, std::int64_t now_s) {
  if (now_s >= holder.valid_until_s) return StageState::kFailed;
  return days_left(holder, now_s) < kKeysEndSoonDays ? StageState::kDegraded : StageState::kRunning;
}

std::string words_of(StageState state, const KeyHolder& holder, const std::string& folder,
                     std::int64_t now_s) {
  const std::string whose = "the daemon's keys in " + folder + ": " + validity_words(holder, now_s);
  const char* const renew = "`tubectl keys renew` where the room was made, copy, systemctl restart tubed";
  if (state == StageState::kFailed) {
    return whose + ". DDS has ended and nobody hears this daemon there: " + renew;
  }
  return state == StageState::kDegraded ? whose + ": " + renew : whose;
}

}  // namespace

KeysOutlet::KeysOutlet(const Configuration& configuration, Outlet& next)
    : ForwardingOutlet(next), folder_(configuration.dds.security) {
  if (folder_.empty()) return;
  const std::int64_t now_s = seconds_since_1970();
  holder_ = examine_keys(folder_, now_s).holder.value_or(KeyHolder{});
  spdlog::info("DDS Security is on: {} ({}) of {}", holder_.name, holder_.role, holder_.room);
  told_days_ = days_left(holder_, now_s) + 1;
  judge(now_s);
}

void KeysOutlet::judge(std::int64_t now_s) {
  const StageState state = state_at(holder_, now_s);
  const std::int64_t now_ns = read_clocks().monotonic_ns;
  const bool is_change = state != report_.state;
  report_.reported_ns = now_ns;
  if (is_change) {
    report_.state = state;
    report_.since_ns = now_ns;
  }
  if (!is_change && days_left(holder_, now_s) == told_days_) return;
  told_days_ = days_left(holder_, now_s);
  const std::string words = words_of(state, holder_, folder_, now_s);
  report_.why.fill('\0');
  if (state != StageState::kRunning) {
    words.copy(report_.why.data(), report_.why.size() - 1);
  }
  if (is_change || state != StageState::kRunning) {
    spdlog::log(state == StageState::kRunning    ? spdlog::level::info
                : state == StageState::kDegraded ? spdlog::level::warn
                                                 : spdlog::level::err,
                "{}", words);
  }
}

void KeysOutlet::publish_status(const PipelineStatus& status) {
  if (folder_.empty()) {
    ForwardingOutlet::publish_status(status);
    return;
  }
  judge(seconds_since_1970());
  stages_.assign(status.stages.begin(), status.stages.end());
  // Never the one that is cut off because there are too many cameras.
  stages_.resize(std::min<std::size_t>(stages_.size(), kMaxStages - 1));
  stages_.push_back({"keys", &report_});
  ForwardingOutlet::publish_status({stages_, status.instruments});
}

}  // namespace tubed
