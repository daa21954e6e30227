#include "clients/calibration/field_error.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/clients/calibration/synthetic_coils.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

/// A coil that rests for a second at each place of a board of 3 x 3 x 3, 60 mm apart; off by `off(p_em)`.
struct Board {
  std::vector<KnownPlace> places;
  CoilRecording recording{"board", one_view_room().instruments.front(), {}};
};
Board board_with(const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& off) {
  Board board;
  const RigidTransform T_em_board(Eigen::Translation3d(-60, -60, -280) *
                                  Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
  Draw draw(1);
  for (int i = 0; i < 27; ++i) {
    const Eigen::Vector3d p_board_mm(60.0 * (i % 3), 60.0 * (i / 3 % 3), 60.0 * (i / 9));
    board.places.push_back({i + 0.1, i + 0.9, p_board_mm});
    for (int n = 0; n < 40; ++n) {
      SequenceMeasurement measurement;
      measurement.t_s = i + 0.025 * n;
      measurement.coil_count = 1;
      const Eigen::Vector3d p_em_mm = T_em_board * p_board_mm;
      measurement.coils[0] = sample_at(p_em_mm + off(p_em_mm) + draw.normal3(0.1), Eigen::Vector3d::UnitZ());
      board.recording.measurements.push_back(measurement);
    }
  }
  return board;
}

TEST(FieldError, AVolumeThatIsRightIsOffByNoiseAlone) {
  const Board board = board_with([](const Eigen::Vector3d&) { return Eigen::Vector3d::Zero(); });
  EXPECT_LT(find_field_error(board.recording, 1, board.places).axis_mm, 0.03);
}

TEST(FieldError, WhatIsDrawnAtEachPlaceIsFound) {
  Draw draw(2);
  const Board board = board_with([&](const Eigen::Vector3d& p_mm) {
    // The same for all measurements of a place.
    Draw at(static_cast<unsigned>(std::lround(1000 + p_mm.x() * 31 + p_mm.y() * 17 + p_mm.z() * 7)));
    return at.normal3(0.8);
  });
  const FieldError error = find_field_error(board.recording, 1, board.places);
  EXPECT_NEAR(error.axis_mm, 0.8, 3 * error.axis_sigma_mm);
  EXPECT_NEAR(error.rms_mm, std::sqrt(3.0) * error.axis_mm, 1e-9);
}

TEST(FieldError, ErrorsThatGrowWithTheDistanceStandInTheTable) {
  const Board board = board_with([](const Eigen::Vector3d& p_mm) {
    const double sign = std::lround(p_mm.x() / 20) % 2 == 0 ? 1 : -1;
    return Eigen::Vector3d(0, 0, sign * 4e-5 * p_mm.squaredNorm() * (p_mm.norm() > 200 ? 1 : 0.1));
  });
  const FieldError error = find_field_error(board.recording, 1, board.places);
  ASSERT_GE(error.bands.size(), 2U);
  EXPECT_GT(error.bands.back().rms_mm, error.bands.front().rms_mm);
  int places = 0;
  for (const DistanceBand& band : error.bands) {
    places += band.places;
  }
  EXPECT_EQ(places, 27);
}

TEST(FieldError, TooFewPlacesAndPlacesOnALineAreRefused) {
  Board board = board_with([](const Eigen::Vector3d&) { return Eigen::Vector3d::Zero(); });
  EXPECT_THROW(find_field_error(board.recording, 1, {board.places.begin(), board.places.begin() + 5}),
               CalibrationError);
  for (std::size_t i = 0; i < board.places.size(); ++i) {
    board.places[i].p_board_mm = {10.0 * static_cast<double>(i), 0, 0};
  }
  EXPECT_THROW(find_field_error(board.recording, 1, board.places), CalibrationError);
}

TEST(FieldError, ACoilThatMovedAtAPlaceIsRefusedByTheNumberOfThePlace) {
  Board board = board_with([](const Eigen::Vector3d&) { return Eigen::Vector3d::Zero(); });
  board.places[3].until_s += 1;
  try {
    find_field_error(board.recording, 1, board.places);
    FAIL() << "not refused";
  } catch (const CalibrationError& error) {
    EXPECT_NE(std::string(error.what()).find("place 4"), std::string::npos) << error.what();
  }
}

TEST(FieldError, PlacesAreReadAndWhatIsWrongIsSaidWithItsLine) {
  const TemporaryFolder folder;
  folder.write("places.csv", "from_s,until_s,x,y,z\n1,2,0,0,0\n3,2.5,10,0,0\n");
  try {
    read_places(folder.path() / "places.csv");
    FAIL() << "not refused";
  } catch (const SequenceError& error) {
    EXPECT_EQ(error.position().line, 3);
  }
}

}  // namespace
}  // namespace tubed
