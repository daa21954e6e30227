#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "clients/evaluation/explanation.hpp"
#include "clients/evaluation/registration.hpp"
#include "clients/evaluation/simulated_run.hpp"
#include "clients/tubectl/see/explanation_picture.hpp"
#include "clients/tubectl/verbs.hpp"
#include "drivers/replay/sequence_image.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

constexpr double kCoils_px = 70;  // where the coils of StraightSequence are seen: 20 mm beside the truth
constexpr double kRidge_px = 73;  // where the picture shows something dark

/// A straight sequence whose first instant has a picture: a dark stripe 4 px wide, from top to bottom.
class Explain : public testing::Test {
 protected:
  Explain() {
    write_stripe(kRidge_px);
    folder_.write("frames.csv", "frame,t_s,camera,file\n0,0.0,A,first.png\n1,1.0,A,\n2,2.0,A,\n");
  }

  void write_stripe(double at_px) {
    GreyImage picture{101, 201, PixelDepth::kGrey8, {}};
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const double off = (x - at_px) / 1.5;
        const int grain = (x * 7 + y * 13) % 5;
        picture.pixels.push_back(
            static_cast<std::uint8_t>(180 + grain - std::lround(60 * std::exp(-0.5 * off * off))));
      }
    }
    write_image(std::filesystem::path(folder_.path()) / "first.png", picture);
  }

  [[nodiscard]] Explanation explained(std::uint32_t frame, EstimatorMode mode = EstimatorMode::kJoint) const {
    EstimatorSettings settings;
    settings.mode = mode;
    return explain_image(read_sequence(folder_.path()), {frame, ""}, settings, FrangiSettings{});
  }

  StraightSequence folder_{3};
};

TEST_F(Explain, EveryLineTellsHowFarTheRidgeLiesFromThePrediction) {
  const Explanation explanation = explained(0);

  ASSERT_GT(explanation.found.in_view, 80);
  EXPECT_GT(explanation.found.inlier_ratio, 0.95);
  for (int i = 10; i < 80; ++i) {
    const CorrespondenceLine& line = explanation.lines[static_cast<std::size_t>(i)];
    EXPECT_NEAR(line.base_px.x(), kCoils_px, 0.1);
    EXPECT_NEAR(line.offset_px * line.normal.x(), kRidge_px - kCoils_px, 0.5) << "line " << i;
  }
}

TEST_F(Explain, ThePosteriorIsHighOnTheTubeAndLowBesideIt) {
  const Explanation explanation = explained(0);

  ASSERT_EQ(explanation.posterior.size(), 101U * 201U);
  EXPECT_GT(explanation.posterior[100 * 101 + 73], 0.9F);
  EXPECT_LT(explanation.posterior[100 * 101 + 60], 0.2F);
}

TEST_F(Explain, ThePredictionKnowsNothingOfTheImage) {
  const Explanation explanation = explained(0);

  EXPECT_FALSE(explanation.before.has_image);
  EXPECT_TRUE(explanation.after.has_image);
  EXPECT_NEAR(explanation.predicted.centreline_px[100].x(), kCoils_px, 0.1);
  EXPECT_NEAR(explanation.estimated.centreline_px[100].x(), kRidge_px, 0.6);
}

TEST_F(Explain, DistancesFromTheTruthAreThoseAcrossIt) {
  const Explanation explanation = explained(0);

  const auto off = distances_px(explanation.predicted, *explanation.truth, explanation.camera);

  ASSERT_GT(off.size(), 150U);
  for (const double px : off) EXPECT_NEAR(px, 20, 0.1);
}

TEST_F(Explain, TheSheetMarksWhatALineFoundWhereItFoundIt) {
  const Explanation explanation = explained(0);

  const cv::Mat lines = draw_lines(explanation);

  // Four pixels a pixel of the image, cut 15 or 16 px left of the bases.
  ASSERT_FALSE(lines.empty());
  std::vector<double> marked_px;
  for (int y = 0; y < lines.rows; ++y) {
    for (int x = 0; x < lines.cols; ++x) {
      const auto pixel = lines.at<cv::Vec3b>(y, x);
      if (pixel[0] > 200 && pixel[1] > 180 && pixel[2] < 120) marked_px.push_back(x / 4.0 + kCoils_px - 15.5);
    }
  }
  ASSERT_GT(marked_px.size(), 200U);
  for (const double x_px : marked_px) EXPECT_NEAR(x_px, kRidge_px, 2.5);
}

/// Rows of the lines' picture in which something is of that colour (blue, green, red), as arc lengths, mm.
std::vector<double> arc_lengths_of(const cv::Mat& lines, const cv::Vec3b& colour) {
  std::vector<double> s_mm;
  for (int y = 0; y < lines.rows; ++y) {
    for (int x = 0; x < lines.cols; ++x) {
      const cv::Vec3i off = cv::Vec3i(lines.at<cv::Vec3b>(y, x)) - cv::Vec3i(colour);
      if (std::max({std::abs(off[0]), std::abs(off[1]), std::abs(off[2])}) < 12) {
        s_mm.push_back(y / 4.0);
        break;
      }
    }
  }
  return s_mm;
}

// The coil lies 10 mm from the tip, and holds 30 mm to either side.
TEST_F(Explain, TheEdgesAreOfTheColourOfWhatHoldsThem) {
  const Explanation explanation = explained(0);
  ASSERT_EQ(explanation.estimated.held_by.size(), explanation.estimated.centreline_px.size());
  EXPECT_EQ(explanation.estimated.held_by[20], kHeldByCoil | kHeldByImage);
  EXPECT_EQ(explanation.estimated.held_by[100], kHeldByImage);
  EXPECT_EQ(explanation.estimated.held_by[250], 0U) << "below the image";

  const cv::Mat lines = draw_lines(explanation);

  const std::vector<double> by_both = arc_lengths_of(lines, {80, 220, 60});
  const std::vector<double> by_image = arc_lengths_of(lines, {230, 170, 0});
  ASSERT_GT(by_both.size(), 20U);
  ASSERT_GT(by_image.size(), 20U);
  EXPECT_LT(by_both.back(), 44);
  EXPECT_GT(by_image.front(), 36);
}

TEST_F(Explain, MarksAreWhereTheShapeHasThem) {
  Sequence sequence = read_sequence(folder_.path());
  sequence.room.instruments.front().marks_mm = {20, 60, 300};
  EstimatorSettings settings;
  settings.mode = EstimatorMode::kJoint;
  const Explanation explanation = explain_image(sequence, {0, ""}, settings, FrangiSettings{});
  ASSERT_EQ(explanation.marks_px.size(), 2U) << "the third is out of the image";
  EXPECT_NEAR(explanation.marks_px[0].y(), 20, 1.5);
  EXPECT_NEAR(explanation.marks_px[1].y(), 60, 1.5);
  EXPECT_GT(arc_lengths_of(draw_lines(explanation), {255, 60, 160}).size(), 7U);
  EXPECT_TRUE(explained(0).marks_px.empty());
}

TEST_F(Explain, AnInstantWithoutFluoroscopyIsExplainedInWords) {
  const Explanation explanation = explained(1);

  EXPECT_EQ(explanation.found.in_view, 0);
  EXPECT_TRUE(draw_lines(explanation).empty());
  EXPECT_FALSE(draw_sheet(explanation).empty());
  EXPECT_EQ(words_of(explanation)[2], "fluoroscopy off: no image");
}

TEST_F(Explain, WhyAnImageTookNoPartIsSaid) {
  EXPECT_EQ(words_of(explained(0, EstimatorMode::kEm))[3],
            "the image took no part: mode em looks at no image");

  write_stripe(20);  // out of reach
  const Explanation beside = explained(0);
  ASSERT_FALSE(beside.after.has_image);
  const std::string words = words_of(beside)[3];
  EXPECT_TRUE(words.starts_with("the image took no part: too few of its lines agree with the shape, "))
      << words;
  EXPECT_TRUE(words.ends_with(" %; expected 62 % or more")) << words;
}

/// The right half of what lies below the panels of a sheet.
cv::Mat legend_of(const cv::Mat& sheet, const Explanation& explanation) {
  const int panels_end_px = 26 + static_cast<int>(std::lround(4.0 * explanation.camera.height));
  return sheet(cv::Rect(sheet.cols / 2, panels_end_px, sheet.cols - sheet.cols / 2, 150));
}

TEST_F(Explain, WordsOfAnyLengthRunIntoNothingElse) {
  Explanation explanation = explained(0);
  explanation.after.agreement.probability = 1;
  explanation.agreement = "they agree";
  const cv::Mat few = draw_sheet(explanation);

  for (const std::string& words :
       {std::string(240, 'm'), "they agree" + std::string(200, ' ') + "and more",
        std::string("a word, and another one, and so on: ") +
            "coils and images agree (as stated 97 %): seen off by 0.6 mm and 0.3 "
            "degrees together, may be by 0.8 and 0.5; 0.1 mm along the tube, 2 ms"}) {
    explanation.agreement = words;
    for (int i = 0; i < 4; ++i) explanation.agreement += " " + words;
    const cv::Mat many = draw_sheet(explanation);

    EXPECT_EQ(cv::norm(legend_of(few, explanation), legend_of(many, explanation), cv::NORM_INF), 0) << words;
    EXPECT_GT(many.rows, few.rows) << "what did not fit goes on below: " << words;
  }
}

TEST_F(Explain, WritesPicturesAndTheTableOfItsLines) {
  const std::string out = folder_.path() + "/explained";

  EXPECT_EQ(
      run_verb(add_explain, {"explain", folder_.path(), "--image", "0", "--mode", "joint", "--out", out}),
      kExitOk);

  EXPECT_FALSE(cv::imread(out + "/frame0-A-joint.png").empty());
  EXPECT_FALSE(cv::imread(out + "/frame0-A-joint-lines.png").empty());
  std::ifstream table(out + "/frame0-A-joint-lines.csv");
  std::string header;
  std::getline(table, header);
  EXPECT_EQ(header, "s_mm,base_x_px,base_y_px,normal_x,normal_y,offset_px,sigma_px,agrees");
}

TEST(RegistrationSummaries, AWideTubeIsCapturedOnlyOutsideOfItsOwnPicture) {
  const auto off_by = [](double px, double width_px) {
    std::vector<RegisteredImage> images(1);
    images[0].distance_px.assign(100, px);
    images[0].width_px = width_px;
    return images;
  };
  EXPECT_EQ(summary_of(off_by(4, 2)).captured, 1U);
  EXPECT_EQ(summary_of(off_by(2.9, 2)).captured, 0U);
  EXPECT_EQ(summary_of(off_by(4, 14)).captured, 0U) << "still on the tube";
  EXPECT_EQ(summary_of(off_by(8, 14)).captured, 1U);
}

TEST_F(Explain, WithoutAnImageEveryMethodTellsHowFarItsTubesLieFromTheTruth) {
  const auto images = register_images(read_sequence(folder_.path()), registration_methods().front().settings,
                                      FrangiSettings{});

  ASSERT_EQ(images.size(), 1U);  // the others are without fluoroscopy
  EXPECT_NEAR(images[0].distance_px[100], kRidge_px - 50, 0.6);
  EXPECT_EQ(summary_of(images).captured, 1U);

  testing::internal::CaptureStdout();
  EXPECT_EQ(run_verb(add_explain, {"explain", folder_.path()}), kExitOk);
  const std::string text = testing::internal::GetCapturedStdout();
  for (const RegistrationMethod& method : registration_methods()) {
    EXPECT_NE(text.find('\n' + method.name + ' '), std::string::npos) << text;
  }
}

TEST_F(Explain, AFrameThatIsNotThereIsRefusedWithThoseThatAre) {
  try {
    (void)explained(17);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("0 to 2"), std::string::npos) << error.what();
  }
}

/// The table is panned by 12 mm after 12 s, and no pose says so.
Explanation explained_after_a_pan(std::uint32_t frame) {
  const TemporaryFolder parent;
  const std::filesystem::path folder = std::filesystem::path(parent.path()) / "run";
  const SimulatedRun run{
      .preset = "field", .seed = 3, .every = 4, .announces_pose = false, .pan_mm = 12, .move_at_s = 12};
  write_simulated_run(run, scenario_of(run), folder);
  return explain_image(read_sequence(folder), {frame, ""}, EstimatorSettings{}, FrangiSettings{});
}

bool says(const Explanation& explanation, const std::string& part) {
  const std::vector<std::string> words = words_of(explanation);
  return std::any_of(words.begin(), words.end(),
                     [&](const auto& line) { return line.find(part) != std::string::npos; });
}

// Its image is none that the estimator is given as such; a person wants to see it all the more.
TEST(ExplainMovedView, TheImageIsShownAndThatTheViewMovedIsSaid) {
  const Explanation explanation = explained_after_a_pan(24);
  EXPECT_TRUE(explanation.view_has_moved);
  EXPECT_EQ(explanation.image.state, ImageState::kMeasured);
  EXPECT_FALSE(draw_lines(explanation).empty());
  EXPECT_TRUE(says(explanation, "the image took no part: the view moved"));
  EXPECT_TRUE(says(explanation, "camera A is lost: it moved"));
}

TEST(ExplainMovedView, IsSeenFromWhereItWasFound) {
  const Explanation explanation = explained_after_a_pan(84);
  EXPECT_TRUE(explanation.view_has_moved);
  EXPECT_TRUE(says(explanation, "the image took part"));
  EXPECT_TRUE(says(explanation, "camera A moved and was found"));
  ASSERT_GT(explanation.found.in_view, 80);
  EXPECT_GT(explanation.found.inlier_ratio, 0.7) << "12 mm are 20 px beside the lines' reach";
}

}  // namespace
}  // namespace tubed
