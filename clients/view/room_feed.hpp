// Shapes, coils, identities and states out of DDS, as messages for the page.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/topic_reader.hpp"
#include "clients/cpp/tube_subscriber.hpp"
#include "clients/view/messages.hpp"
#include "clients/view/outbox.hpp"

namespace tubed {

/// What a RoomFeed calls, from its own thread.
struct RoomFeedCalls {
  std::function<std::uint64_t()> next_number;  ///< of messages
  std::function<void(SharedMessage)> publish;
  /// The cameras that the room has, in; those of them whose images this process shows, out.
  std::function<std::vector<std::string>(const std::vector<std::string>&)> shown_cameras;
};

/// A thread that listens to one room and publishes what it hears. A shape goes out at once; what is known of
/// the room (see room_json) when it changes.
class RoomFeed {
 public:
  /// `known`: what does not come over DDS. Throws DdsError.
  RoomFeed(const Subscription& subscription, RoomKnowledge known, RoomFeedCalls calls);
  ~RoomFeed();
  RoomFeed(const RoomFeed&) = delete;
  RoomFeed& operator=(const RoomFeed&) = delete;

 private:
  void listen();
  void take_room();
  void forget_silent_instruments();
  [[nodiscard]] std::vector<std::string> camera_names() const;
  void show(const TubeSample& sample);
  void publish(MessageKind kind, std::string about, nlohmann::json words);

  RoomKnowledge room_;
  RoomFeedCalls calls_;
  TubeSubscriber shapes_;
  TopicReader<tubed_EmSamples> coils_;
  TopicReader<tubed_TubeIdentity> identities_;
  TopicReader<tubed_TubeStatus> statuses_;
  std::map<std::string, tubed_EmSamples> newest_coils_;  ///< by instrument
  std::string told_room_;
  std::atomic<bool> must_end_{false};
  std::thread thread_;
};

}  // namespace tubed
