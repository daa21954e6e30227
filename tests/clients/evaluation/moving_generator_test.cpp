// The whole way of an offline run with coils alone, the field generator being moved half way.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "clients/evaluation/offline_reconstruction.hpp"
#include "tests/daemon/estimator/reference_bench.hpp"

namespace tubed {
namespace {

constexpr int kPeriod_ms = 25;
constexpr int kPush_ms = 2000;
constexpr int kEnd_ms = 4000;

struct Outcome {
  double max_mm = 0;  ///< of the shape from the arc, over the last second
  std::map<Validity, int> validities;
  Reasons reasons_of_last;
  double sigma_mm = 0;  ///< of the last tip
  std::map<int, Validity> at_ms;
  std::map<int, bool> says_lost_at_ms;
};

using Spoil = std::function<void(int, EmFrame&)>;

/// The generator is pushed by 20 mm and 3 degrees half way. `spoil` sees each measurement with its time.
Outcome run(MovingGenerator generator, const RoomDescription& room, const Spoil& spoil = {}) {
  generator.noise_mm = 0.1;
  Sequence sequence;
  sequence.room = room;
  for (int ms = 0; ms <= kEnd_ms; ms += kPeriod_ms) {
    if (ms == kPush_ms) generator.push(20, 3);
    EmFrame frame = generator.measure(ms);
    if (spoil) spoil(ms, frame);
    SequenceMeasurement measurement;
    measurement.t_s = 1e-3 * ms;
    measurement.em_frame = static_cast<std::uint32_t>(ms);
    measurement.coil_count = frame.coil_count;
    measurement.coils = frame.coils;
    sequence.measurements.push_back(measurement);
    SequenceFrame instant;
    instant.frame = static_cast<std::uint32_t>(ms);
    instant.t_s = 1e-3 * ms;
    sequence.frames.push_back(instant);
  }
  EstimatorSettings settings;
  settings.mode = EstimatorMode::kEm;
  settings.sigma_position_mm = 0.3;
  Outcome found;
  reconstruct(sequence, settings, {}, [&](const SequenceInstant& instant, const TubeEstimate& estimate) {
    const int ms = static_cast<int>(instant.frame);
    ++found.validities[estimate.validity];
    found.at_ms[ms] = estimate.validity;
    found.says_lost_at_ms[ms] = estimate.reasons.has(Reason::kReferenceLost);
    found.reasons_of_last = estimate.reasons;
    if (ms < kEnd_ms - 1000) return;
    found.sigma_mm = std::sqrt(static_cast<double>(estimate.points[0].covariance_mm2[0]));
    for (std::size_t i = 0; i < estimate.point_count; ++i) {
      const double s_mm = 380.0 * static_cast<double>(i) / (kMaxCentrelinePoints - 1);
      const Eigen::Vector3d p_mm = Eigen::Map<const Eigen::Vector3d>(estimate.points[i].p_world_mm.data());
      found.max_mm = std::max(found.max_mm, (p_mm - arc_point(s_mm)).norm());
    }
  });
  return found;
}

TEST(MovingGeneratorOffline, WithoutAReferenceTheShapeIsWrongByTheMovement) {
  const MovingGenerator generator = MovingGenerator::with_sensor();
  RoomDescription room = generator.room;
  room.reference.reset();
  const Outcome found = run(generator, room);
  EXPECT_GT(found.max_mm, 15);
  EXPECT_EQ(found.validities.size(), 1U) << "and nothing says so";
}

class MovingGeneratorWithAReference : public testing::TestWithParam<bool> {
 protected:
  MovingGenerator generator = GetParam() ? MovingGenerator::with_coils() : MovingGenerator::with_sensor();
};
INSTANTIATE_TEST_SUITE_P(SensorOrCoils, MovingGeneratorWithAReference, testing::Bool());

TEST_P(MovingGeneratorWithAReference, TheShapeStaysWithThePatient) {
  const Outcome found = run(generator, generator.room);
  EXPECT_LT(found.max_mm, 1.5);
  EXPECT_EQ(found.at_ms.at(kPush_ms - 500), Validity::kValid);
  EXPECT_EQ(found.at_ms.at(kPush_ms), Validity::kQuestionable);
  EXPECT_TRUE(found.says_lost_at_ms.at(kPush_ms));
  EXPECT_EQ(found.at_ms.at(kEnd_ms), Validity::kValid) << names_of(found.reasons_of_last);
}

TEST_P(MovingGeneratorWithAReference, WithoutItEachShapeSaysSoAndAfterTheTimeoutThereIsNone) {
  const auto lost_for_a_second = [](int ms, EmFrame& frame) {
    if (ms > 1000 && ms <= 2000) frame.coils[5] = CoilSample{};
  };
  const Outcome found = run(generator, generator.room, lost_for_a_second);
  EXPECT_EQ(found.at_ms.at(1000), Validity::kValid);
  EXPECT_EQ(found.at_ms.at(1025), Validity::kQuestionable) << "in the very next sample";
  EXPECT_EQ(found.at_ms.at(1500), Validity::kQuestionable);
  for (int ms = 1525; ms <= 2000; ms += kPeriod_ms) EXPECT_EQ(found.at_ms.at(ms), Validity::kInvalid) << ms;
  for (int ms = 1025; ms <= 2025; ms += kPeriod_ms) EXPECT_TRUE(found.says_lost_at_ms.at(ms)) << ms;
  EXPECT_EQ(found.at_ms.at(2050), Validity::kValid) << "two measurements after it is back";
  EXPECT_LT(found.max_mm, 1.5) << "and the generator was moved in the meantime";
}

TEST_P(MovingGeneratorWithAReference, WhatIsNotKnownOfItIsInTheCovariance) {
  RoomDescription vague = generator.room;
  vague.reference->sigma_angle_deg *= 20;
  vague.reference->sigma_position_mm *= 20;
  const double sharp_mm = run(generator, generator.room).sigma_mm;
  EXPECT_GT(run(generator, vague).sigma_mm, 3 * sharp_mm);
}

}  // namespace
}  // namespace tubed
