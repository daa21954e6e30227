// What the recursive estimator says where coils and images contradict each other.
#include <gtest/gtest.h>

#include <string>

#include "tests/daemon/estimator/filter_bench.hpp"

namespace tubed {
namespace {

/// Five seconds of coils, and images at 10 Hz, in a room that is described like this.
FilterBench five_seconds_in(const RoomDescription& room) {
  FilterBench bench(room);
  bench.measure_times(200);
  return bench;
}

RoomDescription registered_wrong() {
  RoomDescription room = one_view_room();
  room.T_world_em.translation() = Eigen::Vector3d(5, 5, 0);
  return room;
}

std::string words_of(const FilterBench& bench) {
  std::array<char, 256> words{};
  return bench.estimator->describe_disagreement(words) ? words.data() : "";
}

/// Largest over the points.
double max_sigma_in_depth_mm(const TubeEstimate& estimate) {
  double variance_mm2 = 0;
  for (std::size_t i = 0; i < estimate.point_count; ++i) {
    variance_mm2 = std::max(variance_mm2, static_cast<double>(estimate.points[i].covariance_mm2[5]));
  }
  return std::sqrt(variance_mm2);
}

TEST(RecursiveAgreement, NothingIsSaidWhereTheyAgree) {
  const FilterBench bench = five_seconds_in(one_view_room());
  EXPECT_FALSE(bench.estimate->reasons.has(Reason::kEmImageDisagree));
  EXPECT_EQ(bench.estimate->validity, Validity::kValid);
  EXPECT_EQ(words_of(bench), "");
}

TEST(RecursiveAgreement, AWrongRegistrationIsQuestionableAndNamed) {
  const FilterBench bench = five_seconds_in(registered_wrong());
  EXPECT_TRUE(bench.estimate->reasons.has(Reason::kEmImageDisagree));
  EXPECT_EQ(bench.estimate->validity, Validity::kQuestionable);
  EXPECT_NE(words_of(bench).find("cath-1: coils and images disagree: all coils are off together"),
            std::string::npos)
      << words_of(bench);
}

// The view runs along z, and what is off across it may be off as much there.
TEST(RecursiveAgreement, SigmaInDepthGrowsWithWhatIsWrongAcross) {
  const FilterBench right = five_seconds_in(one_view_room());
  const FilterBench wrong = five_seconds_in(registered_wrong());
  EXPECT_GT(max_sigma_in_depth_mm(*wrong.estimate), 2 * max_sigma_in_depth_mm(*right.estimate));
}

TEST(RecursiveAgreement, AResetForgetsTheContradiction) {
  const FilterBench bench = five_seconds_in(registered_wrong());
  bench.estimator->reset();
  EXPECT_EQ(words_of(bench), "");
}

}  // namespace
}  // namespace tubed
