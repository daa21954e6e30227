// The word every sample carries: may this shape be believed, and if not, why.
// Modelled on the measurement status of ISO/IEEE 11073-10201. The numbers are on the wire (TubeEstimate.idl).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace tubed {

/// May the shape be believed? Zero, the value of forgotten memory, means that there is none.
enum class Validity : std::uint32_t { kNotAvailable = 0, kValid = 1, kQuestionable = 2, kInvalid = 3 };

/// Why a shape is not simply VALID: one bit each, so that several can hold at once.
enum class Reason : std::uint32_t {
  kEmStale = 1U << 0,          ///< newest EM frame older than the limit
  kEmStuck = 1U << 1,          ///< coil values bit-equal for too long
  kCoilLost = 1U << 2,         ///< a configured coil is MISSING or DISABLED
  kCoilOutlier = 1U << 3,      ///< a coil reports OK but contradicts the others
  kOutOfVolume = 1U << 4,      ///< a coil is outside the tracker's volume
  kImageOff = 1U << 5,         ///< fluoroscopy is off: EM alone
  kImageStale = 1U << 6,       ///< an image was due and did not come
  kImageRejected = 1U << 7,    ///< an image came and was refused (size, black, saturated, ...)
  kImageLostTube = 1U << 8,    ///< the image does not show the tube where it should be
  kNotConverged = 1U << 9,     ///< the optimizer did not settle
  kNoRegistration = 1U << 10,  ///< EM frame and world are not registered
  kClockUnsynced =
      1U << 11,  ///< the host's real-time clock follows no reference: times on other hosts differ
  kDeadlineMissed = 1U << 12,   ///< the estimate came later than its slot
  kInitialising = 1U << 13,     ///< not enough measurements yet
  kDemoData = 1U << 14,         ///< a simulated source took part; cannot be switched off
  kReplayData = 1U << 15,       ///< a recorded source took part; cannot be switched off
  kRivalWriter = 1U << 16,      ///< somebody else publishes under this instrument's key
  kGeometryChanged = 1U << 17,  ///< table or C-arm moved and no pose said so: that view's images are left out
  kReferenceLost = 1U << 18,    ///< the patient's reference is missing, contradicts itself or has jumped
  kEmImageDisagree = 1U << 19,  ///< coils lie beside the tube of the images by more than both may err
  kTipNotSeen = 1U << 20,       ///< coils or images at the tip contradict the shape it is taken to have
  kAmbiguous = 1U << 21,        ///< another shape whose tip lies elsewhere may be the right one
};
inline constexpr int kReasonCount = 22;

/// A set of reasons, the bit mask on the wire.
class Reasons {
 public:
  constexpr Reasons() = default;
  constexpr explicit Reasons(std::uint32_t bits) : bits_(bits) {}
  constexpr void add(Reason reason) { bits_ |= static_cast<std::uint32_t>(reason); }
  constexpr void add(Reasons others) { bits_ |= others.bits_; }
  [[nodiscard]] constexpr bool has(Reason reason) const {
    return (bits_ & static_cast<std::uint32_t>(reason)) != 0;
  }
  [[nodiscard]] constexpr std::uint32_t bits() const { return bits_; }
  [[nodiscard]] constexpr bool empty() const { return bits_ == 0; }
  friend constexpr bool operator==(Reasons a, Reasons b) = default;

 private:
  std::uint32_t bits_ = 0;
};

/// "NOT_AVAILABLE", "VALID", "QUESTIONABLE", "INVALID"; "UNKNOWN" for a number that is none of them.
std::string_view name_of(Validity validity);

/// The name of one reason as contract and logs write it, e.g. "COIL_LOST".
std::string_view name_of(Reason reason);

/// All names of a set joined by '|' ("COIL_LOST|IMAGE_OFF"), "-" for the empty set. Allocates.
std::string names_of(Reasons reasons);

}  // namespace tubed
