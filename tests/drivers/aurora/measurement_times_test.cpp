// What questions and answers prove of the times of measurements, and when that can be relied upon.
#include "drivers/aurora/measurement_times.hpp"

#include <gtest/gtest.h>

namespace tubed::aurora {
namespace {

MonotonicTime at_ms(int ms) { return from_ns(std::int64_t{ms} * 1'000'000); }

TEST(MeasurementTimes, AnAnswerBoundsItsMeasurementAboveAndTheNextOneBelow) {
  MeasurementTimes times;
  EXPECT_FALSE(times.observe(7, {at_ms(100), at_ms(104), true}));
  EXPECT_LE(times.clock().range(7).latest, at_ms(104));
  EXPECT_GE(times.clock().range(8).earliest, at_ms(100));
}

// Nobody knows which question it answers.
TEST(MeasurementTimes, AnAnswerOutOfStepProvesItsArrivalAlone) {
  MeasurementTimes times;
  EXPECT_FALSE(times.observe(7, {at_ms(100), at_ms(104), false}));
  EXPECT_LE(times.clock().range(7).latest, at_ms(104));
  EXPECT_LT(times.clock().range(8).earliest, at_ms(100));
}

TEST(MeasurementTimes, ARepetitionCountsOnceTheLineHasBeenQuiet) {
  MeasurementTimes times;
  times.observe(7, {at_ms(100), at_ms(104), true});
  times.repeated(7, {at_ms(120), at_ms(123), true});
  times.asked();  // at once: the true answer may follow
  EXPECT_LT(times.clock().range(8).earliest, at_ms(120));
  times.quiet_follows();
  times.asked();
  EXPECT_GE(times.clock().range(8).earliest, at_ms(120));
}

TEST(MeasurementTimes, ACopyOfAnEarlierAnswerProvesNothing) {
  MeasurementTimes times;
  times.observe(7, {at_ms(100), at_ms(104), true});
  times.repeated(7, {at_ms(120), at_ms(123), true});
  times.forget_unverified();  // an answer came that no question was waiting for
  times.quiet_follows();
  times.asked();
  EXPECT_LT(times.clock().range(8).earliest, at_ms(120));
}

// The new measurement may be the late answer to the question before.
TEST(MeasurementTimes, AfterARepetitionTheNextAnswerAsksForAQuietLine) {
  MeasurementTimes times;
  times.observe(7, {at_ms(100), at_ms(104), true});
  times.repeated(7, {at_ms(120), at_ms(123), true});
  EXPECT_TRUE(times.observe(8, {at_ms(124), at_ms(128), true}));
  EXPECT_LT(times.clock().range(9).earliest, at_ms(124));
  times.quiet_follows();
  times.asked();
  EXPECT_GE(times.clock().range(9).earliest, at_ms(124));
}

TEST(MeasurementTimes, LearnsTheTurnaroundAsAMeanOfSixteen) {
  MeasurementTimes times;
  times.observe(1, {at_ms(0), at_ms(8), true});
  EXPECT_EQ(times.turnaround(), std::chrono::microseconds(500));
  times.restart();
  EXPECT_EQ(times.turnaround(), std::chrono::microseconds(500));
  EXPECT_FALSE(times.clock().started());
}

}  // namespace
}  // namespace tubed::aurora
