// Which identifiers the frames of a gateway have: a block of 128 from a base on. Any thread; no state.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace tubed::aurora {

/// Bit of CanFrame::id, as CAN_EFF_FLAG of Linux: the identifier has 29 bits, not 11.
inline constexpr std::uint32_t kCanExtended = 0x8000'0000;

enum class CanIdentifierSize {
  kStandard,  ///< 11 bits
  kExtended   ///< 29 bits
};

/// The first identifier of a gateway's block, a multiple of kBlock. Gateway and listener have to agree on it:
/// frames of another block are somebody else's.
struct CanBase {
  static constexpr std::uint32_t kBlock = 0x80;
  static constexpr std::uint32_t kDefault = 0x300;
  // What stands where in the block.
  static constexpr std::uint32_t kStatusAt = 1;
  static constexpr std::uint32_t kFollowUpAt = 2;
  static constexpr std::uint32_t kFdCoilAt = 0x20;       ///< + coil
  static constexpr std::uint32_t kClassicCoilAt = 0x40;  ///< + 4 coil + part

  std::uint32_t id = kDefault;  ///< with kCanExtended when it has 29 bits

  [[nodiscard]] constexpr std::uint32_t sync() const noexcept { return id; }
  [[nodiscard]] constexpr std::uint32_t status() const noexcept { return id + kStatusAt; }
  [[nodiscard]] constexpr std::uint32_t follow_up() const noexcept { return id + kFollowUpAt; }
  [[nodiscard]] constexpr std::uint32_t fd_coil(int coil) const noexcept {
    return id + kFdCoilAt + static_cast<std::uint32_t>(coil);
  }
  [[nodiscard]] constexpr std::uint32_t classic_part(int coil, int part) const noexcept {
    return id + kClassicCoilAt + 4 * static_cast<std::uint32_t>(coil) + static_cast<std::uint32_t>(part);
  }
  /// Where `frame_id` stands in the block; nothing for identifiers of others.
  [[nodiscard]] constexpr std::optional<std::uint32_t> place_of(std::uint32_t frame_id) const noexcept {
    const std::uint32_t place = frame_id - id;
    return place < kBlock ? std::optional(place) : std::nullopt;
  }
  [[nodiscard]] constexpr bool is_extended() const noexcept { return (id & kCanExtended) != 0; }
  /// The identifier alone, as it is written in a configuration.
  [[nodiscard]] constexpr std::uint32_t number() const noexcept { return id & ~kCanExtended; }

  friend bool operator==(CanBase, CanBase) = default;
};

/// For complaints about one that is none.
inline constexpr std::string_view kWhatCanBasesAre =
    "a base is a multiple of 0x80, up to 0x780, or up to 0x1FFFFF80 with identifiers of 29 bits";

/// Nothing when `number` is no multiple of 0x80 or does not fit: 0 to 0x780, or to 0x1FFFFF80.
[[nodiscard]] constexpr std::optional<CanBase> can_base(std::int64_t number,
                                                        CanIdentifierSize size) noexcept {
  const bool is_extended = size == CanIdentifierSize::kExtended;
  const std::int64_t largest = is_extended ? 0x1FFF'FF80 : 0x780;
  if (number < 0 || number > largest || number % CanBase::kBlock != 0) {
    return std::nullopt;
  }
  return CanBase{static_cast<std::uint32_t>(number) | (is_extended ? kCanExtended : 0)};
}

}  // namespace tubed::aurora
