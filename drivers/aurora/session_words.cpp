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
  for (std::size_t i = 0; i < found().size(); ++i) {
    pulled.set(i, phase_ == Phase::kTrack && found()[i].usable && poller_.has_lost(found()[i].handle));
  }
  return describe_missing(coils(), found(), pulled);
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
  add(words, describe_unused(coils(), found()).text());
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
  if (phase_ == Phase::kTrack) {
    return describe_tracking();
  }
  Problem words;
  if (!complaints_.lasting().empty()) {
    return complaints_.lasting();
  }
  if (phase_ == Phase::kSearch) {
    return words << "looking for the tracker at " << exchange_.baud() << " baud";
  }
  switch (setup_.step()) {
    case TrackerSetup::Step::kPorts:
      return words << "setting up the tools: " << setup_.ports().progress().text();
    case TrackerSetup::Step::kStart:
      return words << "starting to track";
    default:
      return words;
  }
}

Problem Session::describe_tracking() const noexcept {
  Problem words;
  const Problem lacking = missing();
  if (poller_.handles_contradict()) {
    add(words, contradiction().text());
  } else if (!(complaints_.lasting() == lacking)) {
    add(words, complaints_.lasting().text());
  }
  add(words, lacking.text());
  add(words, notes().text());
  return words;
}

}  // namespace tubed::aurora
