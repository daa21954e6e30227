#include "clients/view/room_feed.hpp"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kListen{50};  // how soon the end is noticed
constexpr std::int64_t kMaxCoilAge_ns = 250'000'000;

}  // namespace

RoomFeed::RoomFeed(const Subscription& subscription, RoomKnowledge known, RoomFeedCalls calls)
    : room_(std::move(known)),
      calls_(std::move(calls)),
      shapes_(subscription),
      coils_(subscription),
      identities_(subscription),
      statuses_(subscription),
      thread_([this] { listen(); }) {}

RoomFeed::~RoomFeed() {
  must_end_ = true;
  thread_.join();
}

void RoomFeed::listen() {
  while (!must_end_) {
    const TubeNews news = shapes_.wait_for(kListen);
    take_room();
    if (news.sample != nullptr) show(*news.sample);  // silence is noticed by the page itself
  }
}

void RoomFeed::take_room() {
  bool is_news = told_room_.empty();
  while (const tubed_EmSamples* samples = coils_.take()) newest_coils_[samples->instrument_id] = *samples;
  while (const tubed_TubeIdentity* identity = identities_.take()) {
    room_.identities[identity->instrument_id] = *identity;
    is_news = true;
  }
  while (const tubed_TubeStatus* status = statuses_.take()) {
    room_.statuses[status->instrument_id] = *status;
    is_news = true;
  }
  if (!is_news) return;
  forget_silent_instruments();
  room_.image_cameras = calls_.shown_cameras(camera_names());
  nlohmann::json room = room_json(room_);
  if (std::string words = room.dump(); words != told_room_) {
    told_room_ = std::move(words);
    publish(MessageKind::kRoom, "room", std::move(room));
  }
}

void RoomFeed::forget_silent_instruments() {
  std::erase_if(newest_coils_, [this](const auto& entry) { return !coils_.has(entry.first); });
  std::erase_if(room_.identities, [this](const auto& entry) { return !identities_.has(entry.first); });
  std::erase_if(room_.statuses, [this](const auto& entry) { return !statuses_.has(entry.first); });
}

std::vector<std::string> RoomFeed::camera_names() const {
  std::set<std::string> names;
  for (const auto& [id, identity] : room_.identities) {
    const std::size_t count = std::min<std::size_t>(identity.camera_count, std::size(identity.cameras));
    for (std::size_t i = 0; i < count; ++i) names.insert(identity.cameras[i].name);
  }
  return {names.begin(), names.end()};
}

void RoomFeed::show(const TubeSample& sample) {
  const tubed_TubeEstimate& estimate = sample.estimate;
  const auto coils = newest_coils_.find(estimate.instrument_id);
  const auto identity = room_.identities.find(estimate.instrument_id);
  // Between two times of the daemon's host; valid_time would stay that of the last measurement.
  const bool has_coils =
      coils != newest_coils_.end() && identity != room_.identities.end() &&
      estimate.stamps.publish_started_monotonic_ns - coils->second.measured_monotonic_ns < kMaxCoilAge_ns;
  publish(MessageKind::kEstimate, estimate.instrument_id,
          estimate_json(estimate, sample.received_monotonic_ns, has_coils ? &coils->second : nullptr,
                        has_coils ? identity->second.T_world_em : nullptr));
}

void RoomFeed::publish(MessageKind kind, std::string about, nlohmann::json words) {
  auto message = std::make_shared<Message>();
  message->kind = kind;
  message->about = std::move(about);
  message->number = calls_.next_number();
  words["n"] = message->number;
  message->payload = words.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  calls_.publish(std::move(message));
}

}  // namespace tubed
