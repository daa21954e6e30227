// Binary or text: how the next measurement is asked for.
#pragma once

#include <cstdint>

#include "drivers/interface/timestamps.hpp"

namespace tubed::aurora {

/// BX, unless this firmware does not know it or falls over it: then TX, which works everywhere and takes
/// nearly twice the time. Text is asked for between binary questions that fail, and is kept when it works
/// where binary replies fail again and again; BX is tried again now and then, since a damaged line hurts
/// both. One thread; no allocation.
class EncodingChoice {
 public:
  /// Polling begins.
  void begin(MonotonicTime now) noexcept;
  /// A question is about to be sent: whether it should be TX.
  bool ask_in_text(MonotonicTime now) noexcept;
  /// A reply was understood. Text mode begins with it: true.
  bool understood(bool binary, MonotonicTime now) noexcept;
  /// No reply, or a damaged one.
  void unanswered() noexcept;
  /// The tracker answers BX with an ERRORnn that says that it does not know the command.
  void not_known(std::uint8_t error_code) noexcept;

  [[nodiscard]] bool uses_text() const noexcept { return text_mode_; }
  [[nodiscard]] bool asked_in_text() const noexcept { return asked_text_; }
  /// Code of the ERRORnn that BX was answered with since it worked last; 0: it was not answered, or damaged.
  [[nodiscard]] std::uint8_t refusal() const noexcept { return refusal_; }
  /// Questions without an answer in a row.
  [[nodiscard]] int failures() const noexcept { return failures_; }

 private:
  bool text_mode_ = false;
  bool asked_text_ = false;
  std::uint8_t refusal_ = 0;
  MonotonicTime try_binary_at_{};
  int binary_failures_ = 0;  ///< in a row
  int text_successes_ = 0;   ///< meanwhile
  int failures_ = 0;
};

}  // namespace tubed::aurora
