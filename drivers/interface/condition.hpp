// What state a source is in, beside what it delivers.
#pragma once

#include "drivers/interface/bounded_text.hpp"

namespace tubed {

/// State of the device behind a source.
enum class DeviceState {
  kStarting,      ///< it has never delivered: it is looked for or being set up
  kRunning,       ///< it delivers
  kReconnecting,  ///< it has delivered and does not any more: it is looked for or being set up
};

/// State and words. The words say what is wrong, the cause first, and what to do; a source that runs may lack
/// something, too ("port 2: no tool; sensors 3, 4 left out"). Empty: there is nothing to say.
struct SourceCondition {
  DeviceState state = DeviceState::kStarting;
  BoundedText<255> words;

  friend bool operator==(const SourceCondition&, const SourceCondition&) = default;
};

/// Beside EmSource or ImageSource, for a source that has words of its own once open() has succeeded. It
/// either looks for its device by itself and never answers read() with kLost, or says kReconnecting after a
/// kLost and an open() until it delivers again. Called by the source's own thread.
class HasCondition {
 public:
  virtual ~HasCondition() = default;
  HasCondition() = default;
  HasCondition(const HasCondition&) = delete;
  HasCondition& operator=(const HasCondition&) = delete;

  /// As of the last read(). Never allocates, locks, logs or throws.
  [[nodiscard]] virtual SourceCondition condition() noexcept = 0;
};

}  // namespace tubed
