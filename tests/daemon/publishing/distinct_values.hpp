// Values in which no two fields are equal, so that a field that goes to the wrong place is seen. Also what
// the other vendor's subscriber expects (tests/interop): point i, component k of array a is a + i + k / 8,
// exact in float.
#pragma once

#include <numeric>
#include <string>
#include <type_traits>

#include "daemon/publishing/published_values.hpp"
#include "idl/estimate.hpp"
#include "idl/wire_fields.h"

namespace tubed {

template <typename Array>
void fill(Array& array, double first) {
  for (std::size_t k = 0; k < array.size(); ++k) {
    array[k] = static_cast<typename Array::value_type>(first + static_cast<double>(k) / 8);
  }
}

/// Gives a number of the estimate that is still zero a value of its own: fields that nobody names below.
struct FillUnnamed {
  double next = 900;
  template <typename Field>
  void operator()(Field& field) {
    next += 1;
    if constexpr (std::is_arithmetic_v<Field> && !std::is_same_v<Field, bool>) {
      if (field == Field{}) field = static_cast<Field>(next);
    }
  }
};

/// All fields that the .idl file and the estimate have under one name.
template <typename Estimate>
void fill_unnamed(Estimate& estimate) {
  FillUnnamed fill_field;
#define TUBED_FILL(field) \
  if constexpr (requires { estimate.field; }) fill_field(estimate.field);
#define TUBED_FILL_LIST(list, count)
  TUBED_FIELDS_OF_TubeEstimate(TUBED_FILL, TUBED_FILL_LIST)
#undef TUBED_FILL
#undef TUBED_FILL_LIST
}

inline TubeEstimate distinct_estimate() {
  TubeEstimate estimate;
  estimate.sequence_number = 101;
  estimate.valid_time_ns = 102;
  estimate.validity = Validity::kQuestionable;
  estimate.reasons.add(Reason::kCoilLost);
  estimate.reasons.add(Reason::kImageOff);
  estimate.reasons.add(Reason::kRivalWriter);
  estimate.has_image = true;
  estimate.image_frame = 103;
  estimate.em_frame = 104;
  estimate.em_age_ns = 105;
  estimate.image_age_ns = 106;
  estimate.radius_mm = 107;
  estimate.length_mm = 108;
  estimate.image_inlier_ratio = 0.25F;
  estimate.in_view_ratio = 0.5F;
  estimate.iterations = 109;
  estimate.point_count = kMaxCentrelinePoints;
  for (std::size_t i = 0; i < estimate.points.size(); ++i) {
    fill(estimate.points[i].p_world_mm, 1000 + static_cast<double>(i));
    fill(estimate.points[i].tangent_world, 2000 + static_cast<double>(i));
    fill(estimate.points[i].covariance_mm2, 3000 + static_cast<double>(i));
    estimate.points[i].held_by = static_cast<std::uint32_t>(i % 4);
  }
  estimate.coefficient_count = kMaxCoefficients;
  estimate.coefficient_spacing_mm = 110;
  for (std::size_t i = 0; i < estimate.coefficients_mm.size(); ++i) {
    fill(estimate.coefficients_mm[i], 4000 + static_cast<double>(i));
  }
  estimate.coil_count = kMaxCoils;
  for (std::size_t i = 0; i < estimate.coils.size(); ++i) {
    const auto number = static_cast<float>(i);
    estimate.coils[i] = {.state = static_cast<CoilState>(i % 6),
                         .offset_from_tip_mm = 5000 + number,
                         .position_mm = 6000 + number,
                         .angle_rad = 7000 + number};
  }
  estimate.view_count = kMaxCameras;
  for (std::size_t i = 0; i < estimate.views.size(); ++i) {
    const auto number = static_cast<double>(i);
    estimate.views[i].camera = static_cast<std::uint32_t>(3 - i);
    estimate.views[i].has_own_geometry = i % 2 == 1;
    estimate.views[i].exposure_monotonic_ns = 20000 + static_cast<std::int64_t>(i);
    fill(estimate.views[i].focal_length_px, 21000 + number);
    fill(estimate.views[i].principal_point_px, 22000 + number);
    fill(estimate.views[i].T_camera_world, 23000 + number);
    fill(estimate.views[i].sigma_rotation_rad, 24000 + number);
    fill(estimate.views[i].sigma_translation_mm, 25000 + number);
  }
  estimate.stamps = {111, 112, 113, 114, 115, 116, 117, 118};
  fill_unnamed(estimate);
  return estimate;
}

inline EmSamplesValues distinct_em_samples() {
  EmSamplesValues samples{
      .sequence_number = 201, .measured_ns = 202, .received_ns = 203, .tracker_frame = 204};
  samples.origin = 2;
  samples.coil_count = kMaxCoils;
  for (std::size_t i = 0; i < samples.coils.size(); ++i) {
    samples.coils[i].status = static_cast<std::uint32_t>(i % 4);
    fill(samples.coils[i].p_em_mm, 8000 + static_cast<double>(i));
    fill(samples.coils[i].tangent_em, 9000 + static_cast<double>(i));
    samples.coils[i].indicator = 10000 + static_cast<float>(i);
  }
  return samples;
}

inline NamedStageReport distinct_stage() {
  NamedStageReport stage{.name = "Frangi", .report = {}};
  stage.report.state = StageState::kDegraded;
  stage.report.since_ns = 301;
  stage.report.reported_ns = 400'000;
  std::string_view("half of the images are black").copy(stage.report.why.data(), stage.report.why.size() - 1);
  stage.report.steps = 302;
  stage.report.outputs = 303;
  stage.report.dropped = 304;
  stage.report.refused = 305;
  stage.report.reconnects = 306;
  stage.report.allocations = 307;
  stage.report.busy.count = 308;
  stage.report.busy.max_ns = 309;
  std::iota(stage.report.busy.buckets.begin(), stage.report.busy.buckets.end(), 400);
  return stage;
}

inline InstrumentStatus distinct_status() { return {Validity::kValid, Reasons(7), 310}; }

inline InstrumentHealthValues distinct_health() {
  InstrumentHealthValues health;
  health.estimates = 501;
  health.validity_counts = {502, 503, 504, 505};
  health.exposure_to_publish.count = 506;
  health.exposure_to_publish.max_ns = 507;
  std::iota(health.exposure_to_publish.buckets.begin(), health.exposure_to_publish.buckets.end(), 600);
  health.allocations_counted[0] = true;
  health.agreement = {.disagree = true,
                      .explanation = Discord::kCoilArcLength,
                      .index = 508,
                      .probability = 0.75F,
                      .as_stated = 0.125F,
                      .unsure_mm = 513,
                      .unsure_rad = 514,
                      .arc_length_mm = 509,
                      .end_mm = 510,
                      .clock_s = 511,
                      .magnification = 512};
  fill(health.agreement.shift_mm, 520);
  fill(health.agreement.turn_rad, 530);
  fill(health.agreement.coil_mm, 540);
  return health;
}

inline TubeIdentityValues distinct_identity(const std::string& instrument_id) {
  CameraIdentityValues camera{.name = "frontal", .width_px = 640, .height_px = 480};
  camera.focal_length_px = {1000, 1001};
  camera.principal_point_px = {320.5, 240.5};
  camera.distortion = {0.1, 0.2, 0.3, 0.4, 0.5};
  fill(camera.T_camera_world, 700);
  TubeIdentityValues identity;
  identity.instrument_id = instrument_id;
  identity.software_version = "1.2.3";
  identity.configuration_digest = std::string(64, 'd');
  identity.mode = "em";
  identity.diameter_mm = 801;
  identity.length_mm = 802;
  identity.coil_offsets_from_tip_mm = {803, 804, 805};
  fill(identity.T_world_em, 900);
  identity.registration_residual_mm = 806;
  identity.world_frame = "table top";
  identity.world_axes = "LPS";
  identity.cameras.push_back(camera);
  identity.tracker = {.firmware = "AURORA Rev 008",
                      .api_revision = "D.001.007",
                      .control_unit_serial = "P5-00807",
                      .field_generator = "SC-00808",
                      .tools = {{.port = 809, .serial_number = 810, .part_number = "610811"},
                                {.port = 812, .serial_number = 813, .part_number = "610814"}}};
  return identity;
}

}  // namespace tubed
