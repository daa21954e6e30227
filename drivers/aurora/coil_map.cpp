#include "drivers/aurora/coil_map.hpp"

#include <algorithm>

namespace tubed::aurora {

CoilMap::CoilMap(const RoomDescription& room) noexcept {
  for (const CoilPlacement& coil : tracked_coils(room)) {
    coil_count_ = std::max(coil_count_, std::clamp(coil.sensor, 0, kMaxTrackerCoils));
    const CoilPlug at{coil.port, coil.channel};
    if (coil.port > 0 && !plug(coil.sensor - 1) && !coil_at(at)) {
      place(coil.sensor, at);
      expect(coil.sensor, {coil.tool_serial, BoundedText<20>(coil.tool_part_number)});
    }
  }
}

void CoilMap::place(int sensor, CoilPlug plug) noexcept {
  if (sensor >= 1 && sensor <= kMaxTrackerCoils) {
    plugs_[static_cast<std::size_t>(sensor - 1)] = plug;
    coil_count_ = std::max(coil_count_, sensor);
  }
}

void CoilMap::expect(int sensor, const ExpectedTool& tool) noexcept {
  if (sensor >= 1 && sensor <= kMaxTrackerCoils) {
    expected_[static_cast<std::size_t>(sensor - 1)] = tool;
  }
}

std::optional<CoilPlug> CoilMap::plug(int index) const noexcept {
  if (index < 0 || index >= coil_count_ || plugs_[static_cast<std::size_t>(index)].port == 0) {
    return std::nullopt;
  }
  return plugs_[static_cast<std::size_t>(index)];
}

std::optional<int> CoilMap::coil_at(CoilPlug plug) const noexcept {
  const auto* const found = std::find(plugs_.begin(), plugs_.end(), plug);
  if (plug.port == 0 || found == plugs_.end()) {
    return std::nullopt;
  }
  return static_cast<int>(found - plugs_.begin());
}

}  // namespace tubed::aurora
