#include "clients/view/outbox.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace tubed {

namespace {

constexpr std::size_t kMaxSlots = 64;

std::size_t max_on_their_way(MessageKind kind) {
  switch (kind) {
    case MessageKind::kRoom:
      return std::numeric_limits<std::size_t>::max();  // some a second at most, and the page needs the last
                                                       // one
    case MessageKind::kEstimate:
      return Outbox::kMaxEstimates;
    case MessageKind::kImage:
      return Outbox::kMaxImages;
  }
  return 0;
}

}  // namespace

void Outbox::put(SharedMessage message) {
  if (slots_.size() >= kMaxSlots) {  // instruments that somebody invents come and go
    std::erase_if(slots_, [](const auto& entry) { return entry.second.waiting == nullptr; });
  }
  Slot& slot = slots_[{message->kind, message->about}];
  slot.waiting = std::move(message);
}

SharedMessage Outbox::next() {
  // The map is in the order of the kinds. What waits longest within a kind goes first: no instrument starves
  // another.
  Slot* chosen = nullptr;
  for (auto& [key, slot] : slots_) {
    const bool may_go = slot.waiting && slot.on_their_way.size() < max_on_their_way(key.first);
    if (!may_go) continue;
    if (chosen != nullptr && chosen->waiting->kind != key.first) break;
    if (chosen == nullptr || slot.waiting->number < chosen->waiting->number) chosen = &slot;
  }
  if (chosen == nullptr) return nullptr;
  SharedMessage message = std::exchange(chosen->waiting, nullptr);
  if (message->kind != MessageKind::kRoom) chosen->on_their_way.push_back(message->number);
  return message;
}

void Outbox::acknowledge(std::uint64_t number) {
  for (auto& [key, slot] : slots_) std::erase(slot.on_their_way, number);
}

}  // namespace tubed
