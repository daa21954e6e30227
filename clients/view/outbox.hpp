// What one tab of a browser is sent next. Pure.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace tubed {

/// What a message is about decides how many of them may be on their way at a time.
enum class MessageKind {
  kRoom,      ///< who and what there is
  kEstimate,  ///< of one instrument
  kImage,     ///< of one camera
};

/// One message, the same for every tab; immutable, therefore shared.
struct Message {
  MessageKind kind = MessageKind::kRoom;
  std::string
      about;  ///< instrument, camera; a newer message of the same kind about the same replaces an older one
  std::uint64_t number = 0;  ///< what the page names when it has shown it
  bool is_binary = false;
  std::string payload;
};
using SharedMessage = std::shared_ptr<const Message>;

/// Newest wins, and nothing is queued: of each kind and subject the newest message that was not sent yet. A
/// tab that has not acknowledged what it was sent gets nothing more of that kind: how slow it is decides how
/// much it gets, and what it gets is never old.
class Outbox {
 public:
  /// On their way to one tab: samples of one instrument, pictures of one camera.
  static constexpr std::size_t kMaxEstimates = 5;
  static constexpr std::size_t kMaxImages = 1;

  void put(SharedMessage message);
  /// What is sent now, if anything; it counts as on its way. Room first, then estimates, then images.
  [[nodiscard]] SharedMessage next();
  /// The tab has shown the message of that number. Unknown numbers change nothing.
  void acknowledge(std::uint64_t number);

 private:
  struct Slot {
    SharedMessage waiting;
    std::vector<std::uint64_t> on_their_way;
  };
  using Key = std::pair<MessageKind, std::string>;

  std::map<Key, Slot> slots_;
};

}  // namespace tubed
