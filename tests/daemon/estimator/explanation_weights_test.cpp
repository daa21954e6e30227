// How often is CoilImageAgreement right when it says that it is so sure? Rooms are drawn from what it takes
// for possible, each explanation as often as the others, and count as often as it expects them.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "idl/geometry/degree.hpp"
#include "tests/daemon/estimator/agreement_bench.hpp"

namespace tubed {
namespace {

/// An explanation, and its odds against "as stated" before anything is seen.
struct Cause {
  Discord discord;
  int coil;
  double odds;
};

std::vector<Cause> causes() {
  std::vector<Cause> all{{Discord::kNone, 0, 1},
                         {Discord::kRegistration, 0, 1e-2},
                         {Discord::kArcLengths, 0, 1e-2},
                         {Discord::kClock, 0, 1e-2},
                         {Discord::kField, 0, 1e-3}};
  for (int coil = 0; coil < 5; ++coil) {
    all.push_back({Discord::kCoil, coil, 1e-2});
    all.push_back({Discord::kCoilArcLength, coil, 1e-2});
  }
  return all;
}

/// What is wrong in one room.
struct Wrong {
  Eigen::Vector3d shift_mm;
  Eigen::Vector3d turn_rad;
  double arc_length_mm;
  double clock_s;
  std::array<Eigen::Vector3d, 5> coil_mm;
  std::array<double, 5> coil_arc_length_mm;
};

Wrong draw(const Cause& cause, std::mt19937& random) {
  std::normal_distribution<double> unit;
  const auto normal = [&](double sigma) { return sigma * unit(random); };
  const auto normal3 = [&](double sigma) {
    return Eigen::Vector3d(normal(sigma), normal(sigma), normal(sigma));
  };
  const RoomErrors stated;
  const double share = std::bernoulli_distribution(0.5)(random) ? 1 : 0.2;
  const bool field = cause.discord == Discord::kField;
  Wrong wrong{normal3(share * stated.shift_mm),
              normal3(share * stated.turn_rad),
              normal(stated.arc_length_mm),
              normal(stated.clock_s),
              {},
              {}};
  const Eigen::Vector3d shared_mm = normal3(std::sqrt(0.7) * stated.coil_mm);
  for (std::size_t i = 0; i < 5; ++i) {
    wrong.coil_mm[i] = shared_mm + normal3(std::sqrt(0.3) * stated.coil_mm) + normal3(field ? 4 : 0);
    wrong.coil_arc_length_mm[i] = normal(stated.arc_length_mm);
  }
  const auto coil = static_cast<std::size_t>(cause.coil);
  if (cause.discord == Discord::kRegistration) {
    wrong.shift_mm = normal3(8);
    wrong.turn_rad = normal3(0.06);
  }
  if (cause.discord == Discord::kArcLengths) wrong.arc_length_mm = normal(10);
  if (cause.discord == Discord::kClock) wrong.clock_s = normal(0.15);
  if (cause.discord == Discord::kCoil) wrong.coil_mm[coil] = normal3(20);
  if (cause.discord == Discord::kCoilArcLength) wrong.coil_arc_length_mm[coil] = normal(10);
  return wrong;
}

CoilImageAgreement::Verdict verdict_in(const Wrong& wrong, unsigned seed) {
  AgreementBench bench(one_view_room(), seed);
  bench.motion_mm = [](double t_s) {
    return Eigen::Vector3d(12 * std::sin(1.5 * t_s), 12 * std::cos(1.1 * t_s), 0);
  };
  bench.end_mm = -wrong.arc_length_mm;
  const Mistake mistake = [&](const Eigen::Vector3d& p_mm, int coil, double t_s) -> Eigen::Vector3d {
    const auto i = static_cast<std::size_t>(coil);
    const double s_mm = one_view_room().instruments.front().coils[i].offset_from_tip_mm;
    const Eigen::Vector3d along_mm = arc_point(s_mm - wrong.coil_arc_length_mm[i]) - arc_point(s_mm);
    const Eigen::Vector3d late_mm = bench.motion_mm(t_s + wrong.clock_s) - bench.motion_mm(t_s);
    const Eigen::Vector3d turned_mm = wrong.turn_rad.cross(p_mm - arc_point(kMiddle_mm));
    return p_mm + along_mm + late_mm + wrong.shift_mm + turned_mm + wrong.coil_mm[i];
  };
  return bench.watch(5, mistake).verdict();
}

struct Draw {
  Cause cause;
  double weight;  ///< how often such a room is among those that CoilImageAgreement expects
  CoilImageAgreement::Verdict verdict;

  [[nodiscard]] bool names_cause() const {
    const bool of_a_coil = cause.discord == Discord::kCoil || cause.discord == Discord::kCoilArcLength;
    return verdict.explanation == cause.discord && (!of_a_coil || verdict.index == cause.coil);
  }
};

const std::vector<Draw>& draws() {
  static const std::vector<Draw> all = [] {
    std::vector<Draw> drawn;
    unsigned seed = 1;
    for (const Cause& cause : causes()) {
      const int count = cause.discord == Discord::kNone ? 300 : 60;
      for (int i = 0; i < count; ++i) {
        std::mt19937 random(++seed);
        const Wrong wrong = draw(cause, random);
        drawn.push_back({cause, cause.odds / count, verdict_in(wrong, seed)});
      }
    }
    return drawn;
  }();
  return all;
}

/// Of the draws whose probability lies in one range: its mean, and how often it was right.
struct Reliability {
  double said = 0;
  double right = 0;
  int count = 0;
};

template <typename Probability, typename IsRight>
Reliability reliability(double from, double to, const Probability& probability, const IsRight& is_right) {
  Reliability sum;
  double weight = 0;
  for (const Draw& draw : draws()) {
    const double p = probability(draw);
    if (p < from || p >= to) continue;
    weight += draw.weight;
    sum.said += draw.weight * p;
    sum.right += is_right(draw) ? draw.weight : 0;
    ++sum.count;
  }
  std::printf("said %.2f to %.2f, %d rooms: %.3f, right %.3f\n", from, std::min(to, 1.0), sum.count,
              sum.said / weight, sum.right / weight);
  return {sum.said / weight, sum.right / weight, sum.count};
}

constexpr double kAll = 1.01;

// The mean of a posterior over all that may be seen is the prior.
TEST(ExplanationWeights, OnTheWholeEverythingIsAsStatedAsOftenAsIsSaid) {
  const auto as_stated = [](const Draw& draw) { return draw.verdict.as_stated; };
  const auto is_as_stated = [](const Draw& draw) { return draw.cause.discord == Discord::kNone; };
  const Reliability whole = reliability(0, kAll, as_stated, is_as_stated);
  EXPECT_NEAR(whole.said, whole.right, 0.02);
  // A draw that is as stated weighs as much as twenty of one mistake: the ranges between are of few of them.
  const Reliability hardly = reliability(0, 0.1, as_stated, is_as_stated);
  EXPECT_GT(hardly.count, 500);
  EXPECT_NEAR(hardly.said, hardly.right, 0.02);
  const Reliability nearly = reliability(0.9, kAll, as_stated, is_as_stated);
  EXPECT_GT(nearly.count, 300);
  EXPECT_NEAR(nearly.said, nearly.right, 0.02);
}

TEST(ExplanationWeights, TheMistakeThatIsNamedIsTheRightOneAsOftenAsIsSaid) {
  // Where there is one.
  const auto named = [](const Draw& draw) {
    const bool is_said = draw.verdict.as_stated < 0.5 && draw.cause.discord != Discord::kNone;
    return is_said ? draw.verdict.probability : -1;
  };
  const auto is_right = [](const Draw& draw) { return draw.names_cause(); };
  struct Range {
    double from, to, within;
    int min_count;
  };
  for (const Range& range : {Range{0.5, 0.8, 0.2, 30}, Range{0.8, 0.95, 0.1, 50}, Range{0.95, 0.99, 0.05, 80},
                             Range{0.99, kAll, 0.02, 300}}) {
    const Reliability reliable = reliability(range.from, range.to, named, is_right);
    EXPECT_GE(reliable.count, range.min_count) << range.from;
    EXPECT_NEAR(reliable.said, reliable.right, range.within) << range.from;
  }
}

}  // namespace
}  // namespace tubed
