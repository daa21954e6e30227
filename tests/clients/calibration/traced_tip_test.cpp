// Rest shapes from drawings: arcs that are known, traced with a shaking hand.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include "clients/calibration/coil_recording.hpp"
#include "clients/calibration/traced_tip.hpp"
#include "drivers/csv/sequence_error.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

/// Points of a curve, `step_mm` apart, the tip first, and 30 mm of straight shaft behind it; integrated in
/// small steps, with Gaussian errors, turned and moved as a drawing lies on a table.
Eigen::Matrix2Xd traced(const RestCurve& curve, double step_mm, double sigma_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  constexpr double kStep_mm = 0.001;
  std::vector<Eigen::Vector2d> points;
  Eigen::Vector2d at(40, -12);
  double heading = 0.7;
  double next_mm = 0;
  for (double s_mm = 0; s_mm < curve.length_mm() + 30; s_mm += kStep_mm) {
    if (s_mm >= next_mm) {
      points.emplace_back(at + sigma_mm * Eigen::Vector2d(normal(random), normal(random)));
      next_mm += step_mm;
    }
    at += kStep_mm * Eigen::Vector2d(std::cos(heading), std::sin(heading));
    heading += curve.turn_rad(s_mm, s_mm + kStep_mm);
  }
  Eigen::Matrix2Xd drawing(2, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) drawing.col(static_cast<Eigen::Index>(i)) = points[i];
  return drawing;
}

/// Greatest distance of two curves with the same shaft, mm.
double apart_of_one_side_mm(const RestCurve& a, const RestCurve& b) {
  const double length_mm = std::max(a.length_mm(), b.length_mm());
  const auto places = [length_mm](const RestCurve& curve) {
    std::vector<Eigen::Vector2d> list;
    Eigen::Vector2d at = Eigen::Vector2d::Zero();
    double heading = 0;
    for (double s_mm = length_mm; s_mm > 0; s_mm -= 0.01) {
      at += 0.01 * Eigen::Vector2d(std::cos(heading), std::sin(heading));
      heading += curve.turn_rad(s_mm - 0.01, s_mm);
      list.push_back(at);
    }
    return list;
  };
  const auto of_a = places(a);
  const auto of_b = places(b);
  double apart = 0;
  for (std::size_t i = 0; i < of_a.size(); ++i) apart = std::max(apart, (of_a[i] - of_b[i]).norm());
  return apart;
}

/// The same of the better of both sides: which of them is positive says nothing.
double apart_mm(const RestCurve& a, RestCurve b) {
  const double as_they_are = apart_of_one_side_mm(a, b);
  for (RestArc& arc : b.arcs) arc.radius_mm = -arc.radius_mm;
  return std::min(as_they_are, apart_of_one_side_mm(a, b));
}

const std::vector<RestCurve> kShapes{RestCurve::hook(8, 14),
                                     RestCurve::hook(6, 38),  // round once
                                     {{{8, 0}, {12, 9}, {40, 0}, {30, -25}}},
                                     {{{10, 0}, {14, 7}, {35, 0}, {45, 16}}}};

TEST(TracedTip, ArcsOfAnExactDrawingAreThoseThatWereDrawn) {
  for (const RestCurve& shape : kShapes) {
    const TracedCurve found = fit_arcs({"test", traced(shape, 2, 0, 1)});
    SCOPED_TRACE(shape.length_mm());
    EXPECT_LT(apart_mm(found.curve, shape), 0.5);
    EXPECT_LT(found.max_mm, 0.1);
    EXPECT_FALSE(found.ends_bent);
    EXPECT_NEAR(found.drawn_mm, shape.length_mm() + 30, 2.5);
  }
}

TEST(TracedTip, AShakingHandCostsThreeMillimetresAtMost) {
  for (const RestCurve& shape : kShapes) {
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const TracedCurve found = fit_arcs({"test", traced(shape, 2.5, 0.2, seed)});
      SCOPED_TRACE(shape.length_mm());
      EXPECT_LT(apart_mm(found.curve, shape), 3) << seed;
      EXPECT_NEAR(found.rms_mm, 0.2, 0.1) << seed;
      EXPECT_FALSE(found.ends_bent) << seed;
      EXPECT_LE(found.curve.arcs.size(), shape.arcs.size() + 2) << seed;
    }
  }
}

TEST(TracedTip, ADrawingThatEndsInTheBendIsTold) {
  const Eigen::Matrix2Xd whole = traced(RestCurve::hook(16, 40), 2, 0, 1);
  const TracedCurve found = fit_arcs({"test", whole.leftCols(12)});
  EXPECT_TRUE(found.ends_bent);
  const ConfigurationFragment fragment = fragment_of(found, {"test", whole.leftCols(12)}, "cath-1");
  EXPECT_NE(fragment.remarks.back().find("trace on until it is straight"), std::string::npos);
}

std::string refused_arcs(const Eigen::Matrix2Xd& points) {
  try {
    fit_arcs({"test", points});
  } catch (const CalibrationError& error) {
    return error.what();
  }
  return "";
}

TEST(TracedTip, ArcsThatNoConfigurationTakesAreRefused) {
  const Eigen::Matrix2Xd centimetres = 0.1 * traced({{{30, 0}, {25, 9}}}, 2, 0, 1);
  EXPECT_NE(refused_arcs(centimetres).find("a configuration takes 2 or more: are these millimetres?"),
            std::string::npos)
      << refused_arcs(centimetres);
  const Eigen::Matrix2Xd three_turns = traced(RestCurve::hook(6, 114), 2, 0, 1);
  EXPECT_NE(refused_arcs(three_turns).find("times, a configuration takes 2 at most: are these millimetres"),
            std::string::npos)
      << refused_arcs(three_turns);
}

std::string last_remark(const Eigen::Matrix2Xd& points) {
  return fragment_of(fit_arcs({"test", points}), {"test", points}, "cath-1").remarks.back();
}

TEST(TracedTip, AReversedDrawingIsAskedWhetherItsFirstPointIsTheTip) {
  for (const RestCurve& shape : {RestCurve::hook(16, 40), RestCurve{{{8, 0}, {12, 9}, {40, 0}, {30, -25}}}}) {
    const Eigen::Matrix2Xd whole = traced(shape, 2, 0, 1);
    EXPECT_NE(last_remark(whole.rowwise().reverse()).find("is the first point the tip?"), std::string::npos)
        << last_remark(whole.rowwise().reverse());
    EXPECT_EQ(last_remark(whole).find("is the first point the tip?"), std::string::npos)
        << last_remark(whole);
  }
}

TEST(TracedTip, ADrawingLongerThanATipIsToldWithItsLength) {
  const Eigen::Matrix2Xd pixels = 4.5 * traced(RestCurve::hook(8, 14), 2, 0, 1);
  EXPECT_NE(last_remark(pixels).find("the drawing is 189 mm long"), std::string::npos) << last_remark(pixels);
  EXPECT_NE(last_remark(pixels).find("not the pixels of a photograph"), std::string::npos);
}

TEST(TracedTip, AStraightDrawingHasNoArcs) {
  EXPECT_THROW(fit_arcs({"test", traced({}, 2, 0.1, 1)}), CalibrationError);
}

TEST(TracedTip, TheFragmentIsWhatAConfigurationTakes) {
  const TracedTip drawing{"test", traced(RestCurve::hook(8, 14), 2, 0, 1)};
  const std::string text = to_toml(fragment_of(fit_arcs(drawing), drawing, "cath-1"));
  EXPECT_NE(text.find("[[instrument]]"), std::string::npos) << text;
  EXPECT_NE(text.find("rest_shape = 'arcs'"), std::string::npos) << text;
  EXPECT_NE(text.find("rest_arcs_mm = ["), std::string::npos) << text;
}

class TracedTipFile : public testing::Test {
 protected:
  std::string refused(const std::string& text, double mm_per_px = 0) {
    std::ofstream(folder.path() / "drawing.csv") << text;
    try {
      read_traced_tip(folder.path() / "drawing.csv", mm_per_px);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "";
  }
  TemporaryFolder folder;
};

std::string rows(double scale, double step = 2, int count = 12) {
  std::string text = "x_mm,y_mm\n";
  for (int i = 0; i < count; ++i) {
    text += std::to_string(scale * step * i) + "," + std::to_string(scale * 0.05 * i * i) + "\n";
  }
  return text;
}

TEST_F(TracedTipFile, ADrawingAndAPhotographAreRead) {
  EXPECT_EQ(refused(rows(1)), "");
  std::ofstream(folder.path() / "photo.csv")
      << "x_px,y_px\n0,0\n20,0\n20,0\n40,1\n60,3\n80,6\n100,10\n120,15\n140,21\n";
  const TracedTip photo = read_traced_tip(folder.path() / "photo.csv", 0.15);
  ASSERT_EQ(photo.points_mm.cols(), 8) << "a point that is there twice counts once";
  EXPECT_NEAR(photo.points_mm(0, 7), 21, 1e-12);
}

TEST_F(TracedTipFile, WhatIsNoDrawingIsRefusedWithWhatToDo) {
  EXPECT_NE(refused(rows(1, 2, 5)).find("expected 8 points or more, found 5"), std::string::npos);
  EXPECT_NE(refused(rows(0.001)).find("are these millimetres?"), std::string::npos);
  EXPECT_NE(refused(rows(0.1, 5)).find("are these millimetres?"), std::string::npos) << "centimetres";
  EXPECT_NE(refused(rows(1, 18)).find("trace in steps of 2 or 3 mm"), std::string::npos);
  EXPECT_NE(
      refused("x_mm,y_mm\n0,0\n2,0\n4,0\n6,0\n3,0\n8,0\n10,0\n12,0\n14,0\n").find("turns back at point 4"),
      std::string::npos);
  EXPECT_NE(refused(rows(1), 0.1).find("x_px"), std::string::npos);
  EXPECT_NE(refused("x_mm,y_mm\n0,zero\n").find(":2:"), std::string::npos);
}

TEST_F(TracedTipFile, AFileThatIsNotThereIsAskedForAsADrawing) {
  for (const double mm_per_px : {0.0, 0.2}) {
    try {
      read_traced_tip(folder.path() / "none.csv", mm_per_px);
      FAIL();
    } catch (const std::runtime_error& error) {
      const std::string words = error.what();
      EXPECT_NE(words.find("none.csv: there is no such file; expected a drawing"), std::string::npos)
          << words;
      EXPECT_NE(words.find(mm_per_px > 0 ? "x_px,y_px" : "x_mm,y_mm"), std::string::npos) << words;
    }
  }
}

/// The rows of a drawing with one more column.
std::string with_column(const std::string& name, double step) {
  std::string text;
  std::istringstream lines(rows(1));
  for (std::string line; std::getline(lines, line);) {
    text += line + "," + (text.empty() ? name : std::to_string(7 + step * static_cast<double>(text.size()))) +
            "\n";
  }
  return text;
}

TEST_F(TracedTipFile, BendsOutOfOnePlaneAreRefused) {
  for (const char* const name : {"z_mm", "z"}) {
    EXPECT_EQ(refused(with_column(name, 0)), "") << name;
    EXPECT_NE(refused(with_column(name, 0.1)).find("bends out of one plane are not handled"),
              std::string::npos)
        << name;
  }
  EXPECT_EQ(refused(with_column("remark", 0.1)), "");
}

}  // namespace
}  // namespace tubed
