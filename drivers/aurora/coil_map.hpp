// Which coil of the configuration is plugged in where: shared by all that read an Aurora, over serial or CAN.
// Any thread; no state, no allocation.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>

#include "drivers/interface/bounded_text.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/room.hpp"

namespace tubed::aurora {

/// Where a coil is found: the only thing that tells the two coils of one plug apart, and that stays the same.
struct CoilPlug {
  int port = 0;     ///< counts from 1; 0: not given
  int channel = 0;  ///< 0 or 1

  friend constexpr auto operator<=>(const CoilPlug&, const CoilPlug&) = default;
};

/// The tool that the configuration expects in a plug; what is not given is not compared.
struct ExpectedTool {
  std::optional<std::uint32_t> serial_number;
  BoundedText<20> part_number;  ///< empty: not given

  [[nodiscard]] bool matches(std::uint32_t serial, std::string_view part) const noexcept {
    return (!serial_number || *serial_number == serial) &&
           (part_number.empty() || part_number.text() == part);
  }
};

/// Coil i of every EmFrame (sensor i + 1 of the configuration) and its plug.
class CoilMap {
 public:
  CoilMap() = default;

  /// From the coils of all instruments and of the patient's reference. Coils without a port are left out;
  /// when two coils contradict each other the first one counts (the configuration refuses both).
  explicit CoilMap(const RoomDescription& room) noexcept;

  /// Says where `sensor` (1 to kMaxTrackerCoils) is plugged in.
  void place(int sensor, CoilPlug plug) noexcept;

  /// Says which tool has to be in the plug of `sensor`.
  void expect(int sensor, const ExpectedTool& tool) noexcept;

  /// Coils of a frame: up to the highest sensor that is used, with a port or without.
  [[nodiscard]] int coil_count() const noexcept { return coil_count_; }
  /// Plug of coil `index`; nothing when that sensor is not used.
  [[nodiscard]] std::optional<CoilPlug> plug(int index) const noexcept;
  /// Coil that is plugged in there; nothing when the configuration has none.
  [[nodiscard]] std::optional<int> coil_at(CoilPlug plug) const noexcept;
  /// Tool that coil `index` has to belong to.
  [[nodiscard]] const ExpectedTool& expected(int index) const noexcept {
    return expected_[static_cast<std::size_t>(index)];
  }

 private:
  std::array<CoilPlug, kMaxTrackerCoils> plugs_{};
  std::array<ExpectedTool, kMaxTrackerCoils> expected_{};
  int coil_count_ = 0;
};

}  // namespace tubed::aurora
