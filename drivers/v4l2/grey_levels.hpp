// From the grey values that a card delivers to those of the detector. Pure.
#pragma once

#include <cstdint>
#include <vector>

namespace tubed {

/// How the card's grey values are coded.
struct GreyCoding {
  bool is_limited = false;  ///< as video: black is 16, white 235 of 8 bits (ITU-R BT.709, 4.6)
  double gamma = 1;         ///< of the screen that the signal was made for; 1: values are linear
};

/// A table from each grey value of up to 16 bits to the one delivered. Constructing allocates for 16 bits.
class GreyLevels {
 public:
  explicit GreyLevels(const GreyCoding& coding) : coding_(coding), table_(std::size_t{1} << 16U) {}

  /// For values of `bits` (8 to 16). Never allocates; costs 65536 powers at most.
  void set_bits(int bits) noexcept;
  /// Nothing is changed: values may be copied.
  [[nodiscard]] bool is_identity() const noexcept { return !coding_.is_limited && coding_.gamma == 1; }
  /// Precondition: `value` has no more bits than set_bits() was told.
  [[nodiscard]] std::uint16_t operator[](std::uint16_t value) const noexcept { return table_[value]; }

 private:
  GreyCoding coding_;
  std::vector<std::uint16_t> table_;
};

}  // namespace tubed
