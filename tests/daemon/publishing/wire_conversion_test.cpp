#include "daemon/publishing/wire_conversion.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>
#include <string>
#include <type_traits>

#include "idl/wire_fields.h"
#include "tests/daemon/publishing/distinct_values.hpp"

namespace tubed {
namespace {

constexpr ClockPair kNow{.monotonic_ns = 1'000'000, .realtime_ns = 5'000'000};

TEST(WireConversion, EveryScalarOfAnEstimateIsFoundInItsField) {
  const TubeEstimate estimate = distinct_estimate();
  tubed_TubeEstimate wire{};

  to_wire(estimate, kNow, wire);

  EXPECT_EQ(wire.sequence_number, estimate.sequence_number);
  EXPECT_EQ(wire.valid_time_monotonic_ns, estimate.valid_time_ns);
  EXPECT_EQ(wire.validity, 2U);
  EXPECT_EQ(wire.reasons, 4U | 32U | 65536U);  // COIL_LOST, IMAGE_OFF, RIVAL_WRITER
  EXPECT_TRUE(wire.has_image);
  EXPECT_FALSE(wire.is_image_instant);
  EXPECT_EQ(wire.image_frame, estimate.image_frame);
  EXPECT_EQ(wire.em_frame, estimate.em_frame);
  EXPECT_EQ(wire.em_age_ns, estimate.em_age_ns);
  EXPECT_EQ(wire.image_age_ns, estimate.image_age_ns);
  EXPECT_EQ(wire.radius_mm, estimate.radius_mm);
  EXPECT_EQ(wire.length_mm, estimate.length_mm);
  EXPECT_EQ(wire.image_inlier_ratio, estimate.image_inlier_ratio);
  EXPECT_EQ(wire.in_view_ratio, estimate.in_view_ratio);
  EXPECT_EQ(wire.iterations, estimate.iterations);
}

/// Remembers the numbers of a struct; a bool or a struct is none.
struct Numbers {
  std::map<std::string, double> values;
  template <typename Field>
  void operator()(const char* name, const Field& field) {
    if constexpr (std::is_arithmetic_v<Field> && !std::is_same_v<Field, bool>) {
      values.emplace(name, static_cast<double>(field));
    }
  }
};

/// The numbers that `sample` has under the names of TubeEstimate.idl.
template <typename Sample>
std::map<std::string, double> numbers_of(const Sample& sample) {
  Numbers numbers;
#define TUBED_NUMBER(field) \
  if constexpr (requires { sample.field; }) numbers(#field, sample.field);
#define TUBED_NO_NUMBER(list, count)
  TUBED_FIELDS_OF_TubeEstimate(TUBED_NUMBER, TUBED_NO_NUMBER)
#undef TUBED_NUMBER
#undef TUBED_NO_NUMBER
      return numbers.values;
}

TEST(WireConversion, AFieldThatNoTestNamesIsFoundInItsPlaceToo) {
  const TubeEstimate estimate = distinct_estimate();
  tubed_TubeEstimate wire{};

  to_wire(estimate, kNow, wire);

  std::map<std::string, double> sent = numbers_of(estimate);
  const std::map<std::string, double> found = numbers_of(wire);
  sent["valid_time_ns"] = static_cast<double>(wire.valid_time_ns);  // of another clock
  std::set<double> values;
  for (const auto& [name, value] : sent) {
    EXPECT_EQ(found.at(name), value) << name;
    EXPECT_NE(value, 0) << name;
    EXPECT_TRUE(values.insert(value).second) << name << " cannot be told from another field";
  }
  EXPECT_GE(sent.size(), 14U);
}

TEST(WireConversion, EveryPointCoefficientAndCoilOfAnEstimateIsFoundInItsPlace) {
  const TubeEstimate estimate = distinct_estimate();
  tubed_TubeEstimate wire{};

  to_wire(estimate, kNow, wire);

  ASSERT_EQ(wire.point_count, 128U);
  for (std::size_t i = 0; i < 128; ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(wire.points[i].p_world_mm[k], estimate.points[i].p_world_mm[k]);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(wire.points[i].tangent_world[k], estimate.points[i].tangent_world[k]);
    for (std::size_t k = 0; k < 6; ++k) {
      EXPECT_EQ(wire.points[i].covariance_mm2[k], estimate.points[i].covariance_mm2[k]);
    }
    EXPECT_EQ(wire.points[i].held_by, i % 4);
  }
  ASSERT_EQ(wire.coefficient_count, 64U);
  EXPECT_EQ(wire.coefficient_spacing_mm, estimate.coefficient_spacing_mm);
  for (std::size_t i = 0; i < 64; ++i) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(wire.coefficients_mm[i][k], estimate.coefficients_mm[i][k]);
  }
  ASSERT_EQ(wire.coil_count, 16U);
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(wire.coils[i].state, i % 6);
    EXPECT_EQ(wire.coils[i].offset_from_tip_mm, estimate.coils[i].offset_from_tip_mm);
    EXPECT_EQ(wire.coils[i].position_mm, estimate.coils[i].position_mm);
    EXPECT_EQ(wire.coils[i].angle_rad, estimate.coils[i].angle_rad);
  }
}

TEST(WireConversion, EveryViewOfAnEstimateIsFoundInItsPlace) {
  const TubeEstimate estimate = distinct_estimate();
  tubed_TubeEstimate wire{};

  to_wire(estimate, kNow, wire);

  ASSERT_EQ(wire.view_count, 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(wire.views[i].camera, 3 - i);
    EXPECT_EQ(wire.views[i].has_own_geometry, i % 2 == 1);
    EXPECT_EQ(wire.views[i].exposure_monotonic_ns, estimate.views[i].exposure_monotonic_ns);
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_EQ(wire.views[i].focal_length_px[k], estimate.views[i].focal_length_px[k]);
      EXPECT_EQ(wire.views[i].principal_point_px[k], estimate.views[i].principal_point_px[k]);
    }
    for (std::size_t k = 0; k < 16; ++k) {
      EXPECT_EQ(wire.views[i].T_camera_world[k], estimate.views[i].T_camera_world[k]);
    }
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(wire.views[i].sigma_rotation_rad[k], estimate.views[i].sigma_rotation_rad[k]);
      EXPECT_EQ(wire.views[i].sigma_translation_mm[k], estimate.views[i].sigma_translation_mm[k]);
    }
  }
}

TEST(WireConversion, EveryStageStampIsFoundInItsFieldAndPublishingAddsItsOwn) {
  const TubeEstimate estimate = distinct_estimate();
  tubed_TubeEstimate wire{};

  to_wire(estimate, kNow, wire);

  EXPECT_EQ(wire.stamps.exposure_monotonic_ns, estimate.stamps.exposure_ns);
  EXPECT_EQ(wire.stamps.image_grabbed_monotonic_ns, estimate.stamps.image_grabbed_ns);
  EXPECT_EQ(wire.stamps.frangi_started_monotonic_ns, estimate.stamps.frangi_started_ns);
  EXPECT_EQ(wire.stamps.frangi_finished_monotonic_ns, estimate.stamps.frangi_finished_ns);
  EXPECT_EQ(wire.stamps.em_measured_monotonic_ns, estimate.stamps.em_measured_ns);
  EXPECT_EQ(wire.stamps.em_received_monotonic_ns, estimate.stamps.em_received_ns);
  EXPECT_EQ(wire.stamps.optimizer_started_monotonic_ns, estimate.stamps.optimizer_started_ns);
  EXPECT_EQ(wire.stamps.optimizer_finished_monotonic_ns, estimate.stamps.optimizer_finished_ns);
  EXPECT_EQ(wire.stamps.publish_started_monotonic_ns, kNow.monotonic_ns);
}

TEST(WireConversion, ValidTimeBecomesRealTimeByTheOffsetOfThatMoment) {
  TubeEstimate estimate;
  estimate.valid_time_ns = 900'000;  // 0.1 ms before kNow
  tubed_TubeEstimate wire{};

  to_wire(estimate, kNow, wire);

  EXPECT_EQ(wire.valid_time_ns, 4'900'000);
  EXPECT_EQ(wire.publish_time_ns, 5'000'000);
}

TEST(WireConversion, CountsBeyondTheArraysAreCut) {
  TubeEstimate estimate;
  estimate.point_count = 129;
  estimate.coefficient_count = 65;
  estimate.coil_count = 17;
  tubed_TubeEstimate wire{};

  to_wire(estimate, kNow, wire);

  EXPECT_EQ(wire.point_count, 128U);
  EXPECT_EQ(wire.coefficient_count, 64U);
  EXPECT_EQ(wire.coil_count, 16U);
}

TEST(WireConversion, EmSamplesKeepTheirFieldsAndGetRealTime) {
  const EmSamplesValues samples = distinct_em_samples();
  tubed_EmSamples wire{};

  to_wire(samples, kNow, wire);

  EXPECT_EQ(wire.sequence_number, samples.sequence_number);
  EXPECT_EQ(wire.measured_monotonic_ns, samples.measured_ns);
  EXPECT_EQ(wire.measured_ns, samples.measured_ns + 4'000'000);
  EXPECT_EQ(wire.received_monotonic_ns, samples.received_ns);
  EXPECT_EQ(wire.tracker_frame, samples.tracker_frame);
  EXPECT_EQ(wire.origin, samples.origin);
  ASSERT_EQ(wire.coil_count, 16U);
  for (std::size_t i = 0; i < 16; ++i) {
    EXPECT_EQ(wire.coils[i].status, samples.coils[i].status);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(wire.coils[i].p_em_mm[k], samples.coils[i].p_em_mm[k]);
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(wire.coils[i].tangent_em[k], samples.coils[i].tangent_em[k]);
    EXPECT_EQ(wire.coils[i].indicator, samples.coils[i].indicator);
  }
}

TEST(WireConversion, AStageStatusSaysWhatSinceWhenAndWhy) {
  NamedStageReport stage{.name = "EM acquisition", .report = {}};
  stage.report.state = StageState::kReconnecting;
  stage.report.since_ns = 400'000;
  stage.report.reported_ns = 700'000;
  std::string_view("no answer for 0.2 s").copy(stage.report.why.data(), stage.report.why.size() - 1);
  tubed_TubeStatus wire{};

  to_wire({Validity::kInvalid, Reasons(1), 123}, std::span(&stage, 1), kNow, wire);

  EXPECT_EQ(wire.time_ns, kNow.realtime_ns);
  EXPECT_EQ(wire.validity, 3U);
  EXPECT_EQ(wire.reasons, 1U);
  EXPECT_EQ(wire.estimate_age_ns, 123);
  ASSERT_EQ(wire.stage_count, 1U);
  EXPECT_STREQ(wire.stages[0].name, "EM acquisition");
  EXPECT_EQ(wire.stages[0].state, 3U);
  EXPECT_EQ(wire.stages[0].since_ns, 4'400'000);
  EXPECT_EQ(wire.stages[0].age_ns, 300'000);
  EXPECT_STREQ(wire.stages[0].why, "no answer for 0.2 s");
}

TEST(WireConversion, WordsOfAStageArriveInFullUpToTheLastCharacter) {
  NamedStageReport stage{.name = "em", .report = {}};
  const std::string words = std::string(254, 'w') + "z";
  words.copy(stage.report.why.data(), stage.report.why.size() - 1);
  tubed_TubeStatus wire{};

  to_wire({.validity = Validity::kValid, .reasons = {}}, std::span(&stage, 1), kNow, wire);

  EXPECT_EQ(std::string(wire.stages[0].why), words);
  EXPECT_EQ(wire.stages[0].age_ns, -1) << "it never reported";
}

TEST(WireConversion, HealthCarriesEveryCounterOfEveryStage) {
  const InstrumentHealthValues health = distinct_health();
  const NamedStageReport stage = distinct_stage();
  tubed_TubeHealth wire{};

  to_wire(health, std::span(&stage, 1), kNow, wire);

  EXPECT_EQ(wire.time_ns, kNow.realtime_ns);
  EXPECT_EQ(wire.estimates, health.estimates);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(wire.validity_counts[i], health.validity_counts[i]);
  EXPECT_EQ(wire.exposure_to_publish.count, health.exposure_to_publish.count);
  EXPECT_EQ(wire.exposure_to_publish.max_ns, health.exposure_to_publish.max_ns);
  EXPECT_TRUE(wire.agreement.disagree);
  EXPECT_EQ(wire.agreement.explanation, 7U);
  EXPECT_EQ(wire.agreement.index, health.agreement.index);
  EXPECT_EQ(wire.agreement.probability, health.agreement.probability);
  EXPECT_EQ(wire.agreement.as_stated, health.agreement.as_stated);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(wire.agreement.shift_mm[k], health.agreement.shift_mm[k]);
    EXPECT_EQ(wire.agreement.turn_rad[k], health.agreement.turn_rad[k]);
    EXPECT_EQ(wire.agreement.coil_mm[k], health.agreement.coil_mm[k]);
  }
  EXPECT_EQ(wire.agreement.unsure_mm, health.agreement.unsure_mm);
  EXPECT_EQ(wire.agreement.unsure_rad, health.agreement.unsure_rad);
  EXPECT_EQ(wire.agreement.arc_length_mm, health.agreement.arc_length_mm);
  EXPECT_EQ(wire.agreement.end_mm, health.agreement.end_mm);
  EXPECT_EQ(wire.agreement.clock_s, health.agreement.clock_s);
  EXPECT_EQ(wire.agreement.magnification, health.agreement.magnification);
  ASSERT_EQ(wire.stage_count, 1U);
  EXPECT_STREQ(wire.stages[0].name, "Frangi");
  EXPECT_EQ(wire.stages[0].steps, stage.report.steps);
  EXPECT_EQ(wire.stages[0].outputs, stage.report.outputs);
  EXPECT_EQ(wire.stages[0].dropped, stage.report.dropped);
  EXPECT_EQ(wire.stages[0].refused, stage.report.refused);
  EXPECT_EQ(wire.stages[0].reconnects, stage.report.reconnects);
  EXPECT_EQ(wire.stages[0].allocations, stage.report.allocations);
  EXPECT_TRUE(wire.stages[0].allocations_counted);
  EXPECT_EQ(wire.stages[0].busy.count, stage.report.busy.count);
  for (std::size_t i = 0; i < 96; ++i)
    EXPECT_EQ(wire.stages[0].busy.buckets[i], stage.report.busy.buckets[i]);
}

TEST(WireConversion, IdentityKeepsItsFieldsAndCutsTextThatIsTooLong) {
  TubeIdentityValues identity = distinct_identity("catheter");
  identity.mode = std::string(40, 'm');
  tubed_TubeIdentity wire{};

  to_wire(identity, wire);

  EXPECT_STREQ(wire.instrument_id, "catheter");
  EXPECT_STREQ(wire.software_version, "1.2.3");
  EXPECT_STREQ(wire.configuration_digest, identity.configuration_digest.c_str());
  EXPECT_EQ(std::string(wire.mode), std::string(32, 'm'));
  EXPECT_EQ(wire.diameter_mm, identity.diameter_mm);
  EXPECT_EQ(wire.length_mm, identity.length_mm);
  ASSERT_EQ(wire.coil_count, 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(wire.coil_offsets_from_tip_mm[i], identity.coil_offsets_from_tip_mm[i]);
  }
  for (std::size_t i = 0; i < 16; ++i) EXPECT_EQ(wire.T_world_em[i], identity.T_world_em[i]);
  EXPECT_EQ(wire.registration_residual_mm, identity.registration_residual_mm);
  EXPECT_STREQ(wire.world_frame, "table top");
  EXPECT_STREQ(wire.world_axes, "LPS");
  ASSERT_EQ(wire.camera_count, 1U);
  EXPECT_STREQ(wire.cameras[0].name, "frontal");
  EXPECT_EQ(wire.cameras[0].width, 640U);
  EXPECT_EQ(wire.cameras[0].height, 480U);
  EXPECT_EQ(wire.cameras[0].focal_length_px[1], 1001.0);
  EXPECT_EQ(wire.cameras[0].principal_point_px[1], 240.5);
  EXPECT_EQ(wire.cameras[0].distortion[4], 0.5);
  EXPECT_EQ(wire.cameras[0].T_camera_world[15], identity.cameras[0].T_camera_world[15]);
}

TEST(WireConversion, TheTrackerAndEachOfItsToolsKeepTheirFields) {
  tubed_TubeIdentity wire{};

  to_wire(distinct_identity("catheter"), wire);

  EXPECT_STREQ(wire.tracker.firmware, "AURORA Rev 008");
  EXPECT_STREQ(wire.tracker.api_revision, "D.001.007");
  EXPECT_STREQ(wire.tracker.control_unit_serial, "P5-00807");
  EXPECT_STREQ(wire.tracker.field_generator, "SC-00808");
  ASSERT_EQ(wire.tracker.tool_count, 2U);
  EXPECT_EQ(wire.tracker.tools[1].port, 812U);
  EXPECT_EQ(wire.tracker.tools[1].serial_number, 813U);
  EXPECT_STREQ(wire.tracker.tools[1].part_number, "610814");
}

TEST(WireConversion, AnIdentityThatHasLostItsToolsSaysSo) {
  TubeIdentityValues identity = distinct_identity("catheter");
  tubed_TubeIdentity wire{};
  to_wire(identity, wire);
  identity.tracker = {};

  to_wire(identity, wire);

  EXPECT_EQ(wire.tracker.tool_count, 0U);
  EXPECT_STREQ(wire.tracker.firmware, "");
}

}  // namespace
}  // namespace tubed
