#include "bench/accuracy/disturbances.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

/// Frames half a second apart, two coils at (1, 2, 3) and (4, 5, 6) in each of as many measurements.
Sequence sequence_of(std::size_t count) {
  Sequence sequence;
  for (std::size_t i = 0; i < count; ++i) {
    SequenceFrame& frame = sequence.frames.emplace_back();
    frame.frame = static_cast<std::uint32_t>(i);
    frame.t_s = 10 + 0.5 * static_cast<double>(i);
    frame.file = std::to_string(i) + ".png";
    SequenceMeasurement& measurement = sequence.measurements.emplace_back();
    measurement.t_s = frame.t_s;
    measurement.coil_count = 2;
    measurement.coils[0] = {CoilStatus::kOk, {1, 2, 3}, {1, 0, 0}};
    measurement.coils[1] = {CoilStatus::kOk, {4, 5, 6}, {1, 0, 0}};
  }
  return sequence;
}

std::string on_and_off(const Sequence& sequence) {
  std::string words;
  for (const SequenceFrame& frame : sequence.frames) words += frame.fluoroscopy_on() ? '#' : '.';
  return words;
}

TEST(Disturbances, FluoroscopyIsOffAtTheEndOfEveryPeriod) {
  EXPECT_EQ(on_and_off(with_fluoroscopy_off_for(sequence_of(10), 1, 2)), "##..##..##");
  EXPECT_EQ(on_and_off(with_fluoroscopy_off_for(sequence_of(4), 0, 2)), "####");
}

TEST(Disturbances, AsManyCoilsAreMissingAsAsked) {
  const Sequence dropped = with_coils_dropped(sequence_of(1000), 0.25, 1);

  int missing = 0;
  for (const SequenceMeasurement& measurement : dropped.measurements) {
    for (int i = 0; i < 2; ++i) {
      missing += measurement.coils[static_cast<std::size_t>(i)].status != CoilStatus::kOk;
    }
  }
  EXPECT_NEAR(missing, 500, 4 * std::sqrt(2000 * 0.25 * 0.75));
}

TEST(Disturbances, ALyingCoilIsWrongByThatMuchAndAlwaysTheSameAndTheOtherIsRight) {
  const Sequence lying = with_coil_lying(sequence_of(3), 1, 25, 7);

  for (const SequenceMeasurement& measurement : lying.measurements) {
    EXPECT_NEAR((measurement.coils[1].p_em_mm - Eigen::Vector3d(4, 5, 6)).norm(), 25, 1e-9);
    EXPECT_EQ(measurement.coils[1].status, CoilStatus::kOk);
    EXPECT_EQ(measurement.coils[1].p_em_mm, lying.measurements.front().coils[1].p_em_mm);
    EXPECT_EQ(measurement.coils[0].p_em_mm, Eigen::Vector3d(1, 2, 3));
  }
}

TEST(Disturbances, AnErraticCoilIsWrongByThatMuchAtTheEndOfEveryPeriodAndNeverTheSame) {
  const Sequence erratic = with_coil_erratic(sequence_of(8), 1, 25, 1, 2, 7);

  std::vector<Eigen::Vector3d> errors_mm;
  for (const SequenceMeasurement& measurement : erratic.measurements) {
    errors_mm.push_back(measurement.coils[1].p_em_mm - Eigen::Vector3d(4, 5, 6));
    EXPECT_EQ(measurement.coils[0].p_em_mm, Eigen::Vector3d(1, 2, 3));
  }
  for (const std::size_t right : {0, 1, 4, 5}) EXPECT_EQ(errors_mm[right], Eigen::Vector3d::Zero()) << right;
  for (const std::size_t wrong : {2, 3, 6, 7}) EXPECT_NEAR(errors_mm[wrong].norm(), 25, 1e-9) << wrong;
  EXPECT_GT((errors_mm[2] - errors_mm[3]).norm(), 1);
}

TEST(Disturbances, ACoilIsMissingAtTheEndOfEveryPeriodAndTheOtherIsNot) {
  const Sequence without = with_coil_missing(sequence_of(8), 1, 1, 2);

  for (std::size_t i = 0; i < without.measurements.size(); ++i) {
    const SequenceMeasurement& measurement = without.measurements[i];
    EXPECT_EQ(measurement.coils[1].status == CoilStatus::kOk, i % 4 < 2) << i;
    EXPECT_EQ(measurement.coils[0].status, CoilStatus::kOk);
  }
}

TEST(Disturbances, ACoilThatNoMeasurementHasIsRefused) {
  EXPECT_THROW(with_coil_missing(sequence_of(3), 2, 1, 2), std::invalid_argument);
  EXPECT_THROW(with_coil_lying(sequence_of(3), 2, 25, 7), std::invalid_argument);
}

TEST(Disturbances, EveryFewImagesTheFirstOneIsShownAgain) {
  Sequence sequence = sequence_of(6);
  sequence.frames[1].file.clear();  // off, and stays so

  const Sequence wrong = with_wrong_images(sequence, 2);

  const std::vector<std::string> expected{"0.png", "", "0.png", "3.png", "0.png", "5.png"};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_EQ(wrong.frames[i].file, expected[i]) << i;
}

}  // namespace
}  // namespace tubed
