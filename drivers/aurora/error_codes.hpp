// What an Aurora's ERRORnn means and what a session does about it. Any thread; no state.
#pragma once

#include <cstdint>
#include <string_view>

namespace tubed::aurora {

/// What to do about an error.
enum class Remedy {
  kRetry,         ///< send the same command again
  kReinitialise,  ///< the device is not in the state we thought: go through the start-up (or the handle's)
                  ///< again
  kGiveUpTool,    ///< this tool cannot be used; go on without it
  kCheckLink,     ///< the line is damaged or set differently at its two ends
  kReport,        ///< nothing helps but a person
};

struct ErrorDescription {
  std::string_view meaning;
  Remedy remedy = Remedy::kReport;
};

/// Meaning of the two hexadecimal digits after ERROR. A code that no list has is "unknown error", to be
/// reported.
[[nodiscard]] ErrorDescription describe_error(std::uint8_t code) noexcept;

/// What `remedy` asks for, as the end of a sentence: "send it again".
[[nodiscard]] std::string_view remedy_text(Remedy remedy) noexcept;

}  // namespace tubed::aurora
