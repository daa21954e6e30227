#include "clients/calibration/marker_collector.hpp"

#include <gtest/gtest.h>

#include "idl/geometry/rigid_transform.hpp"
#include "tests/clients/calibration/simulated_markers.hpp"

namespace tubed {
namespace {

/// A probe held in a shaking hand, its coil 100 mm above the tip.
class Hand {
 public:
  explicit Hand(MarkerCollector& collector) : collector_(collector) {}

  /// Holds the tip there for so many measurements; all lines that were answered.
  std::string hold(const Eigen::Vector3d& tip_em_mm, int count, double sigma_mm = 0.1) {
    std::string lines;
    for (int i = 0; i < count; ++i) {
      ProbePose pose;
      pose.frame = ++frame_;
      const Eigen::Vector3d toward_tip(0, 0.6, 0.8);
      pose.q_em_probe = rotation_from_z_to(toward_tip);
      pose.p_em_mm = tip_em_mm - 100 * toward_tip + normal_vector(random_, sigma_mm);
      for (const std::string& line : collector_.add(pose)) lines += line + '\n';
    }
    return lines;
  }

  std::string lose(int count) {
    std::string lines;
    for (int i = 0; i < count; ++i) {
      for (const std::string& line : collector_.add({.frame = ++frame_, .is_seen = false}))
        lines += line + '\n';
    }
    return lines;
  }

 private:
  MarkerCollector& collector_;
  std::mt19937 random_{1};
  std::uint32_t frame_ = 0;
};

class MarkerCollectorTest : public testing::Test {
 protected:
  MarkerCollector collector_{{"M1", "M2", "M3"}, {.tip_offset_mm = {0, 0, 100}}};
  Hand hand_{collector_};
};

bool has(const std::string& text, const std::string& words) { return text.find(words) != std::string::npos; }

TEST_F(MarkerCollectorTest, AMarkerIsTheMeanOf40MeasurementsOfTheTip) {
  collector_.type("");

  const std::string lines = hand_.hold({10, 20, 30}, 60);

  EXPECT_TRUE(has(lines, "M1: taken, 40 measurements")) << lines;
  ASSERT_EQ(collector_.touched().size(), 1);
  // 0.1 mm along each axis, 40 of them: four standard deviations of the mean
  EXPECT_LT((collector_.touched()[0].p_em_mm - Eigen::Vector3d(10, 20, 30)).cwiseAbs().maxCoeff(),
            4 * 0.1 / 6.3);
  EXPECT_NEAR(collector_.touched()[0].scatter_mm, 0.1 * std::sqrt(3.0), 0.05);
}

TEST_F(MarkerCollectorTest, NothingIsTakenBeforeItIsAskedFor) {
  EXPECT_EQ(hand_.hold({10, 20, 30}, 200), "");
  EXPECT_TRUE(collector_.touched().empty());
}

TEST_F(MarkerCollectorTest, MarkersAreTouchedInAnyOrderByNameOrNumber) {
  collector_.type("M3");
  hand_.hold({30, 0, 0}, 60);
  collector_.type("1");
  hand_.hold({10, 0, 0}, 60);

  ASSERT_EQ(collector_.markers().size(), 2);
  EXPECT_EQ(collector_.markers()[0].name, "M1");
  EXPECT_NEAR(collector_.markers()[0].p_mm.x(), 10, 0.1);
  EXPECT_EQ(collector_.markers()[1].name, "M3");
  EXPECT_NEAR(collector_.markers()[1].p_mm.x(), 30, 0.1);
}

TEST_F(MarkerCollectorTest, AMarkerThatIsTouchedAgainIsReplaced) {
  collector_.type("M2");
  hand_.hold({20, 0, 0}, 60);
  EXPECT_TRUE(has(collector_.type("M2").front(), "again"));
  hand_.hold({21, 0, 0}, 60);

  ASSERT_EQ(collector_.markers().size(), 1);
  EXPECT_NEAR(collector_.markers()[0].p_mm.x(), 21, 0.1);
}

TEST_F(MarkerCollectorTest, AHandThatDoesNotHoldStillIsToldAndNothingIsTaken) {
  collector_.type("M1");

  const std::string lines = hand_.hold({10, 0, 0}, 300, 1.5);

  EXPECT_TRUE(has(lines, "not still yet")) << lines;
  EXPECT_TRUE(collector_.touched().empty());
}

TEST_F(MarkerCollectorTest, ScatterBeyondHalfAMillimetreIsRefused) {
  collector_.type("M1");
  hand_.hold({10, 0, 0}, 15, 0.05);  // still, and measuring

  std::string lines;
  for (int i = 0; i < 12; ++i) {
    // slides to and fro by 2 mm, which is no jump
    lines += hand_.hold({10 + (i % 2 == 0 ? 1.0 : -1.0), 0, 0}, 4, 0.05);
  }

  EXPECT_TRUE(has(lines, "refused, it scattered")) << lines;
  EXPECT_TRUE(collector_.touched().empty());
}

TEST_F(MarkerCollectorTest, ATipThatLeavesTheMarkerBeginsAnew) {
  collector_.type("M1");
  hand_.hold({10, 0, 0}, 25);

  EXPECT_TRUE(has(hand_.hold({18, 0, 0}, 1), "moved"));
  hand_.hold({18, 0, 0}, 60);

  EXPECT_NEAR(collector_.markers().at(0).p_mm.x(), 18, 0.1);
}

TEST_F(MarkerCollectorTest, AProbeThatIsNotSeenIsTold) {
  collector_.type("M1");
  hand_.hold({10, 0, 0}, 20);

  EXPECT_TRUE(has(hand_.lose(40), "does not see the probe"));
  EXPECT_TRUE(has(hand_.hold({10, 0, 0}, 60), "M1: taken"));
}

TEST_F(MarkerCollectorTest, OneMeasurementThatCameTwiceCountsOnce) {
  collector_.type("M1");
  const ProbePose pose{.frame = 7, .p_em_mm = {1, 2, 3}};

  for (int i = 0; i < 200; ++i) collector_.add(pose);

  EXPECT_TRUE(collector_.touched().empty());
}

TEST_F(MarkerCollectorTest, QEndsAndKeepsWhatWasTouched) {
  collector_.type("");
  hand_.hold({10, 0, 0}, 60);

  collector_.type("q");

  EXPECT_TRUE(collector_.is_finished());
  EXPECT_EQ(collector_.markers().size(), 1);
}

TEST_F(MarkerCollectorTest, EnterEndsWhenNothingIsMissing) {
  for (int i = 0; i < 3; ++i) {
    EXPECT_FALSE(collector_.is_finished());
    collector_.type("");
    hand_.hold({10.0 * i, 0, 0}, 60);
  }
  collector_.type("");

  EXPECT_TRUE(collector_.is_finished());
  EXPECT_EQ(collector_.markers().size(), 3);
}

TEST_F(MarkerCollectorTest, ANameThatIsNoneNamesThoseThereAre) {
  EXPECT_TRUE(has(collector_.type("M7").front(), "M1, M2 and M3"));
  EXPECT_TRUE(has(collector_.type("4").front(), "no marker"));
}

}  // namespace
}  // namespace tubed
