#include "drivers/aurora/coil_map.hpp"

#include <algorithm>

namespace tubed::aurora {

namespace {

bool contains(std::span<const CoilPlug> plugs, CoilPlug plug) noexcept {
  return std::find(plugs.begin(), plugs.end(), plug) != plugs.end();
}

void name(Problem& words, CoilPlug plug) noexcept {
  words << "port " << plug.port << " channel " << plug.channel;
}

}  // namespace

CoilMap::CoilMap(const RoomDescription& room) noexcept {
  for (const InstrumentDescription& instrument : room.instruments) {
    for (const CoilPlacement& coil : instrument.coils) {
      coil_count_ = std::max(coil_count_, std::clamp(coil.sensor, 0, kMaxTrackerCoils));
      const CoilPlug at{coil.port, coil.channel};
      if (coil.port > 0 && !plug(coil.sensor - 1) && !coil_at(at)) {
        place(coil.sensor, at);
      }
    }
  }
}

void CoilMap::place(int sensor, CoilPlug plug) noexcept {
  if (sensor >= 1 && sensor <= kMaxTrackerCoils) {
    plugs_[static_cast<std::size_t>(sensor - 1)] = plug;
    coil_count_ = std::max(coil_count_, sensor);
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

Problem describe_missing(const CoilMap& map, std::span<const CoilPlug> found) noexcept {
  Problem words;
  int missing = 0;
  for (int index = 0; index < map.coil_count(); ++index) {
    const auto plug = map.plug(index);
    if (plug && !contains(found, *plug)) {
      words << (missing++ == 0 ? "not plugged in or not usable: sensor " : ", sensor ") << index + 1 << " (";
      name(words, *plug);
      words << ")";
    }
  }
  if (missing == 0) {
    return words;
  }
  int others = 0;
  for (const CoilPlug& plug : found) {
    if (!map.coil_at(plug)) {
      words << (others++ == 0 ? "; plugged in instead: " : ", ");
      name(words, plug);
    }
  }
  if (others == 0) {
    words << (found.empty() ? "; nothing is plugged in" : "; nothing else is plugged in");
  }
  return words;
}

}  // namespace tubed::aurora
