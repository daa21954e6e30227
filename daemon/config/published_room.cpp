#include "daemon/config/published_room.hpp"

#include <array>
#include <cstddef>

namespace tubed {

namespace {

std::array<double, 16> row_by_row(const RigidTransform& transform) {
  std::array<double, 16> values{};
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      values[static_cast<std::size_t>(4 * row + column)] = transform.matrix()(row, column);
    }
  }
  return values;
}

CameraIdentityValues identity_of(const CameraCalibration& camera) {
  return {camera.name,
          static_cast<std::uint32_t>(camera.width),
          static_cast<std::uint32_t>(camera.height),
          {camera.fx, camera.fy},
          {camera.cx, camera.cy},
          camera.distortion,
          row_by_row(camera.T_camera_world)};
}

std::uint32_t wire_status(CoilStatus status) {
  switch (status) {
    case CoilStatus::kMissing:
      return 0;
    case CoilStatus::kOk:
      return 1;
    case CoilStatus::kOutOfVolume:
      return 2;
    case CoilStatus::kDisabled:
      return 3;
  }
  return 0;
}

CoilSample as_registered(CoilSample sample, const EmPlacement& placement) {
  sample.p_em_mm = placement.T_registered_em * sample.p_em_mm;
  sample.tangent_em = placement.T_registered_em.linear() * sample.tangent_em;
  return sample;
}

}  // namespace

TubeIdentityValues identity_of(const RoomDescription& room, const InstrumentDescription& instrument,
                               EstimatorMode mode) {
  TubeIdentityValues identity;
  identity.instrument_id = instrument.id;
  identity.software_version = TUBED_VERSION;
  identity.mode = name_of(mode);
  identity.diameter_mm = static_cast<float>(instrument.diameter_mm);
  identity.length_mm = static_cast<float>(instrument.length_mm);
  for (const CoilPlacement& coil : instrument.coils) {
    identity.coil_offsets_from_tip_mm.push_back(static_cast<float>(coil.offset_from_tip_mm));
  }
  identity.T_world_em = row_by_row(room.T_world_em);
  if (room.registration_residual_mm) {
    identity.registration_residual_mm = static_cast<float>(*room.registration_residual_mm);
  }
  for (const CameraCalibration& camera : room.cameras) {
    identity.cameras.push_back(identity_of(camera));
  }
  return identity;
}

void fill_coils(const InstrumentDescription& instrument, const EmFrame& frame,
                const std::optional<EmPlacement>& placement, EmSamplesValues& values) {
  values.measured_ns = to_ns(frame.measured);
  values.received_ns = to_ns(frame.received);
  values.tracker_frame = frame.tracker_frame;
  values.origin = static_cast<std::uint32_t>(frame.origin);
  values.coil_count = 0;
  for (const CoilPlacement& coil : instrument.coils) {
    EmCoilValues& to = values.coils[values.coil_count++];
    const auto sensor = static_cast<std::size_t>(coil.sensor - 1);
    const bool is_known = placement && coil.sensor <= frame.coil_count;
    const CoilSample sample = is_known ? as_registered(frame.coils[sensor], *placement) : CoilSample{};
    const double sign = coil.flipped ? -1 : 1;
    to.status = wire_status(sample.status);
    to.indicator = static_cast<float>(sample.indicator);
    for (int axis = 0; axis < 3; ++axis) {
      to.p_em_mm[static_cast<std::size_t>(axis)] = sample.p_em_mm[axis];
      to.tangent_em[static_cast<std::size_t>(axis)] = sign * sample.tangent_em[axis];
    }
  }
}

}  // namespace tubed
