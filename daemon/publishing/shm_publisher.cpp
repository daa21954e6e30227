#include "daemon/publishing/shm_publisher.hpp"

#include <grp.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <span>

#include "daemon/publishing/wire_conversion.hpp"

namespace tubed {

namespace {

// The struct in shared memory is the one that idlc makes, written down without a DDS header.
template <auto ours, auto wires>
constexpr bool kSamePlace = ours == wires;
#define TUBED_SAME_PLACE(member) \
  static_assert(kSamePlace<offsetof(tubed_shm_estimate, member), offsetof(tubed_TubeEstimate, member)>)
TUBED_SAME_PLACE(instrument_id);
TUBED_SAME_PLACE(sequence_number);
TUBED_SAME_PLACE(daemon_start);
TUBED_SAME_PLACE(valid_time_ns);
TUBED_SAME_PLACE(valid_time_monotonic_ns);
TUBED_SAME_PLACE(publish_time_ns);
TUBED_SAME_PLACE(validity);
TUBED_SAME_PLACE(reasons);
TUBED_SAME_PLACE(has_image);
TUBED_SAME_PLACE(is_image_instant);
TUBED_SAME_PLACE(image_frame);
TUBED_SAME_PLACE(em_frame);
TUBED_SAME_PLACE(em_age_ns);
TUBED_SAME_PLACE(image_age_ns);
TUBED_SAME_PLACE(radius_mm);
TUBED_SAME_PLACE(length_mm);
TUBED_SAME_PLACE(image_inlier_ratio);
TUBED_SAME_PLACE(in_view_ratio);
TUBED_SAME_PLACE(iterations);
TUBED_SAME_PLACE(point_count);
TUBED_SAME_PLACE(points);
TUBED_SAME_PLACE(coefficient_count);
TUBED_SAME_PLACE(coefficient_spacing_mm);
TUBED_SAME_PLACE(coefficients_mm);
TUBED_SAME_PLACE(coil_count);
TUBED_SAME_PLACE(coils);
TUBED_SAME_PLACE(stamps);
#undef TUBED_SAME_PLACE
static_assert(sizeof(tubed_shm_estimate) == sizeof(tubed_TubeEstimate));
static_assert(sizeof(tubed_shm_point) == sizeof(tubed_CentrelinePoint));
static_assert(offsetof(tubed_shm_point, tangent_world) == offsetof(tubed_CentrelinePoint, tangent_world));
static_assert(offsetof(tubed_shm_point, covariance_mm2) == offsetof(tubed_CentrelinePoint, covariance_mm2));
static_assert(sizeof(tubed_shm_coil) == sizeof(tubed_CoilResidual));
static_assert(offsetof(tubed_shm_coil, offset_from_tip_mm) ==
              offsetof(tubed_CoilResidual, offset_from_tip_mm));
static_assert(offsetof(tubed_shm_coil, position_mm) == offsetof(tubed_CoilResidual, position_mm));
static_assert(offsetof(tubed_shm_coil, angle_rad) == offsetof(tubed_CoilResidual, angle_rad));
static_assert(sizeof(tubed_shm_stamps) == sizeof(tubed_StageStamps));
static_assert(offsetof(tubed_shm_stamps, publish_started_monotonic_ns) ==
              offsetof(tubed_StageStamps, publish_started_monotonic_ns));

// Of eight instruments at 30 Hz the newest 64 samples are a quarter of a second.
constexpr std::uint32_t kSlots = 64;

std::optional<gid_t> group_of(const std::string& name) {
  if (name.empty()) {
    return {};
  }
  group entry{};
  group* found = nullptr;
  std::vector<char> words(std::size_t{1} << 16U);
  if (getgrnam_r(name.c_str(), &entry, words.data(), words.size(), &found) != 0 || found == nullptr) {
    throw ShmError("shm.group: this system has no group '" + name + "'");
  }
  return entry.gr_gid;
}

ShmWriterSettings writer_settings(const ShmSettings& settings) {
  return {.door = {settings.estimates_socket, group_of(settings.group)},
          .geometry = {kSlots, sizeof(tubed_shm_estimate)},
          .identity = {TUBED_SHM_ESTIMATES, TUBED_SHM_ESTIMATES_VERSION, "tubed", 0}};
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

void ShmPublisher::publish(const TubeEstimate& estimate, const ClockPair& now) noexcept {
  if (estimate.instrument >= instrument_ids_.size()) {
    return;
  }
  tubed_TubeEstimate& wire = scratch_->wire;
  to_wire(estimate, now, wire);
  std::memset(wire.instrument_id, 0, sizeof(wire.instrument_id));
  const std::string& id = instrument_ids_[estimate.instrument];
  std::copy_n(id.data(), std::min(id.size(), sizeof(wire.instrument_id) - 1), wire.instrument_id);
  writer_.publish(std::as_bytes(std::span(&wire, 1)), now.monotonic_ns);
}

}  // namespace tubed
