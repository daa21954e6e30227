// Which coil of the configuration is plugged in where: shared by all that read an Aurora, over serial or CAN.
// Any thread; no state, no allocation.
#pragma once

#include <array>
#include <compare>
#include <optional>
#include <span>

#include "drivers/aurora/words.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/room.hpp"

namespace tubed::aurora {

/// Where a coil is found: the only thing that tells the two coils of one plug apart, and that stays the same.
struct CoilPlug {
  int port = 0;     ///< counts from 1; 0: not given
  int channel = 0;  ///< 0 or 1

  friend constexpr auto operator<=>(const CoilPlug&, const CoilPlug&) = default;
};

/// Coil i of every EmFrame (sensor i + 1 of the configuration) and its plug.
class CoilMap {
 public:
  CoilMap() = default;

  /// From the coils of all instruments. Coils without a port are left out; when two coils contradict each
  /// other the first one counts (the configuration refuses both).
  explicit CoilMap(const RoomDescription& room) noexcept;

  /// Says where `sensor` (1 to kMaxTrackerCoils) is plugged in.
  void place(int sensor, CoilPlug plug) noexcept;

  /// Coils of a frame: up to the highest sensor that is used, with a port or without.
  [[nodiscard]] int coil_count() const noexcept { return coil_count_; }
  /// Plug of coil `index`; nothing when that sensor is not used.
  [[nodiscard]] std::optional<CoilPlug> plug(int index) const noexcept;
  /// Coil that is plugged in there; nothing when the configuration has none.
  [[nodiscard]] std::optional<int> coil_at(CoilPlug plug) const noexcept;

 private:
  std::array<CoilPlug, kMaxTrackerCoils> plugs_{};
  int coil_count_ = 0;
};

/// What is missing of `map` when only `found` is plugged in, and what is plugged in instead; empty when
/// nothing is missing. "not plugged in or not usable: sensor 2 (port 1 channel 1); plugged in instead: port 2
/// channel 0".
[[nodiscard]] Problem describe_missing(const CoilMap& map, std::span<const CoilPlug> found) noexcept;

}  // namespace tubed::aurora
