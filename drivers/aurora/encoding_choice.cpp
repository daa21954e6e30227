#include "drivers/aurora/encoding_choice.hpp"

#include <algorithm>

namespace tubed::aurora {

namespace {

constexpr int kFailuresUntilText = 4;      // questions without answer until text is tried between
constexpr int kBinaryFailuresForText = 8;  // of these, binary ones beside which text worked
constexpr int kTextSuccessesForText = 3;
constexpr std::chrono::seconds kTryBinaryEvery{20};

}  // namespace

void EncodingChoice::begin(MonotonicTime now) noexcept {
  failures_ = binary_failures_ = text_successes_ = 0;
  try_binary_at_ = now;
}

bool EncodingChoice::ask_in_text(MonotonicTime now) noexcept {
  asked_text_ = text_mode_ ? now < try_binary_at_ : failures_ >= kFailuresUntilText && failures_ % 2 == 0;
  if (text_mode_ && !asked_text_) {
    try_binary_at_ = now + kTryBinaryEvery;
  }
  return asked_text_;
}

bool EncodingChoice::understood(bool binary, MonotonicTime now) noexcept {
  failures_ = 0;
  if (binary) {
    binary_failures_ = text_successes_ = 0;
    text_mode_ = false;
    refusal_ = 0;
    return false;
  }
  ++text_successes_;
  const bool give_up_binary =
      binary_failures_ >= kBinaryFailuresForText && text_successes_ >= kTextSuccessesForText;
  if (!text_mode_ && give_up_binary) {
    text_mode_ = true;
    try_binary_at_ = now + kTryBinaryEvery;
    return true;
  }
  if (!text_mode_) {
    failures_ = kFailuresUntilText - 1;  // ask in binary next, then in text again
  }
  return false;
}

void EncodingChoice::unanswered() noexcept {
  ++failures_;
  binary_failures_ += asked_text_ ? 0 : 1;
}

void EncodingChoice::not_known(std::uint8_t error_code) noexcept {
  refusal_ = error_code;
  binary_failures_ += 2;
  failures_ = std::max(failures_ + 1, kFailuresUntilText);
}

}  // namespace tubed::aurora
