// What a session has to say to a person.
#include "drivers/aurora/port_words.hpp"
#include "drivers/aurora/session.hpp"

namespace tubed::aurora {

namespace {

void add(Problem& words, std::string_view more) noexcept {
  if (!more.empty()) {
    words << (words.empty() ? "" : "; ") << more;
  }
}

void list(Problem& words, std::span<const std::uint8_t> handles) noexcept {
  for (const std::uint8_t handle : handles) {
    (words << " ").hex(handle);
  }
  words << (handles.empty() ? " none" : "");
}

}  // namespace

// While tracking a tool may have been pulled; what was found is from before.
Problem Session::missing() const noexcept {
  FoundSet pulled;
  for (std::size_t i = 0; i < ports_.found().size(); ++i) {
    pulled.set(
        i, phase_ == Phase::kTrack && ports_.found()[i].usable && poller_.has_lost(ports_.found()[i].handle));
  }
  return describe_missing(coils_, ports_.found(), pulled);
}

Problem Session::notes() const noexcept {
  Problem words;
  if (phase_ == Phase::kTrack) {
    add(words, describe_system_status(poller_.system_status()).text());
    if (const int handle = poller_.handles().newcomer(); handle >= 0) {
      Problem newcomer("a tool was plugged in while tracking and is not tracked (handle ");
      newcomer.hex(static_cast<unsigned>(handle)) << ")";
      add(words, newcomer.text());
    }
  }
  add(words, describe_unused(coils_, ports_.found()).text());
  return words;
}

Problem Session::contradiction() const noexcept {
  Problem words("the tracker reports the handles");
  list(words, poller_.handles().reported());
  words << " while";
  list(words, poller_.handles().tracked());
  return words << " are enabled; switch the tracker off and on";
}

Problem Session::describe() const noexcept {
  Problem words;
  switch (phase_) {
    case Phase::kTrack:
      if (poller_.handles_contradict()) {
        add(words, contradiction().text());
      } else if (!(trouble_ == missing())) {
        add(words, trouble_.text());
      }
      add(words, missing().text());
      add(words, notes().text());
      return words;
    case Phase::kPorts:
      if (trouble_.empty()) {
        return words << "setting up the tools: " << ports_.progress().text();
      }
      break;
    case Phase::kSearch:
      if (trouble_.empty()) {
        return words << "looking for the tracker at " << exchange_.baud() << " baud";
      }
      break;
    case Phase::kStart:
      if (trouble_.empty()) {
        return words << "starting to track";
      }
      break;
    default:
      break;
  }
  return trouble_;
}

}  // namespace tubed::aurora
