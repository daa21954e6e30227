#include "daemon/publishing/shm_publisher.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>

#include "daemon/publishing/shm_group.hpp"
#include "daemon/publishing/wire_conversion.hpp"
#include "idl/wire_fields.h"

namespace tubed {

namespace {

// The struct in shared memory is the one that idlc makes, field by field.
template <auto ours, auto wires>
constexpr bool kSamePlace = ours == wires;
#define TUBED_SAME_FIELD(field) static_assert(kSamePlace<offsetof(Ours, field), offsetof(Wires, field)>);
#define TUBED_SAME_LIST(list, count) TUBED_SAME_FIELD(list)
#define TUBED_SAME_STRUCT(name, type)                         \
  namespace same_##type {                                     \
    using Ours = name;                                        \
    using Wires = tubed_##type;                               \
    static_assert(sizeof(Ours) == sizeof(Wires));             \
    TUBED_FIELDS_OF_##type(TUBED_SAME_FIELD, TUBED_SAME_LIST) \
  }
TUBED_SAME_STRUCT(tubed_shm_point, CentrelinePoint)
TUBED_SAME_STRUCT(tubed_shm_coil, CoilResidual)
TUBED_SAME_STRUCT(tubed_shm_view, ViewUsed)
TUBED_SAME_STRUCT(tubed_shm_stamps, StageStamps)
TUBED_SAME_STRUCT(tubed_shm_estimate, TubeEstimate)
#undef TUBED_SAME_FIELD
#undef TUBED_SAME_LIST
#undef TUBED_SAME_STRUCT

// Of eight instruments at 30 Hz the newest 64 samples are a quarter of a second.
constexpr std::uint32_t kSlots = 64;

ShmWriterSettings writer_settings(const ShmSettings& settings) {
  return {.door = {settings.estimates_socket, group_of(settings.group)},
          .geometry = {kSlots, sizeof(tubed_shm_estimate)},
          .identity = {TUBED_SHM_ESTIMATES, TUBED_SHM_ESTIMATES_VERSION, "tubed", 0},
          .waking = ShmWaking::kFirst};
}

}  // namespace

struct ShmPublisher::Scratch {
  tubed_TubeEstimate wire{};  // zero from the start: what lies beyond the counts is never somebody's memory
};

ShmPublisher::ShmPublisher(const ShmSettings& settings, std::vector<std::string> instrument_ids,
                           std::uint64_t daemon_start, const ClockPair& now)
    : instrument_ids_(std::move(instrument_ids)),
      scratch_(std::make_unique<Scratch>()),
      writer_(writer_settings(settings), now.monotonic_ns) {
  scratch_->wire.daemon_start = daemon_start;
}

ShmPublisher::~ShmPublisher() = default;

bool ShmPublisher::publish(const TubeEstimate& estimate, const ClockPair& now) noexcept {
  if (estimate.instrument >= instrument_ids_.size()) {
    return false;
  }
  tubed_TubeEstimate& wire = scratch_->wire;
  to_wire(estimate, now, wire);
  std::memset(wire.instrument_id, 0, sizeof(wire.instrument_id));
  const std::string& id = instrument_ids_[estimate.instrument];
  std::copy_n(id.data(), std::min(id.size(), sizeof(wire.instrument_id) - 1), wire.instrument_id);
  writer_.publish(std::as_bytes(std::span(&wire, 1)), now.monotonic_ns);
  return writer_.leaves_sleepers();
}

}  // namespace tubed
