#include "idl/validity.hpp"

#include <array>

namespace tubed {

namespace {
constexpr std::array<std::string_view, kReasonCount> kReasonNames = {
    "EM_STALE",        "EM_STUCK",       "COIL_LOST",        "COIL_OUTLIER",    "OUT_OF_VOLUME",
    "IMAGE_OFF",       "IMAGE_STALE",    "IMAGE_REJECTED",   "IMAGE_LOST_TUBE", "NOT_CONVERGED",
    "NO_REGISTRATION", "CLOCK_UNSYNCED", "DEADLINE_MISSED",  "INITIALISING",    "DEMO_DATA",
    "REPLAY_DATA",     "RIVAL_WRITER",   "GEOMETRY_CHANGED", "REFERENCE_LOST",  "EM_IMAGE_DISAGREE",
    "TIP_NOT_SEEN",    "AMBIGUOUS"};
}  // namespace

std::string_view name_of(Validity validity) {
  switch (validity) {
    case Validity::kNotAvailable:
      return "NOT_AVAILABLE";
    case Validity::kValid:
      return "VALID";
    case Validity::kQuestionable:
      return "QUESTIONABLE";
    case Validity::kInvalid:
      return "INVALID";
  }
  return "UNKNOWN";
}

std::string_view name_of(Reason reason) {
  for (std::size_t bit = 0; bit < kReasonNames.size(); ++bit) {
    if (static_cast<std::uint32_t>(reason) == 1U << bit) {
      return kReasonNames[bit];
    }
  }
  return "UNKNOWN";
}

std::string names_of(Reasons reasons) {
  std::string joined;
  for (std::size_t bit = 0; bit < kReasonNames.size(); ++bit) {
    if ((reasons.bits() & (1U << bit)) != 0) {
      joined.append(joined.empty() ? "" : "|").append(kReasonNames[bit]);
    }
  }
  return joined.empty() ? "-" : joined;
}

}  // namespace tubed
