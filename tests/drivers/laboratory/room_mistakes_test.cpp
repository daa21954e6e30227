#include "drivers/laboratory/room_mistakes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "drivers/laboratory/simulated_tracker.hpp"
#include "drivers/laboratory/simulated_view.hpp"
#include "tests/drivers/laboratory/simulated_room.hpp"

namespace tubed {
namespace {

const MistakeDraw kDraw{7, {5, -20, 60}};

/// A room that is neither at the origin nor turned by nothing.
RoomDescription some_room() {
  RoomDescription room = paper_room();
  room.T_world_em =
      Eigen::Translation3d(30, -200, 15) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, -1).normalized());
  return room;
}

std::string refusal_of(const std::vector<std::string>& words) {
  try {
    const RoomMistakes mistakes = parse_mistakes(words);
    described_room(some_room(), mistakes, kDraw);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

std::vector<double> offsets_of(const RoomDescription& room) {
  std::vector<double> offsets;
  for (const CoilPlacement& coil : room.instruments.front().coils) offsets.push_back(coil.offset_from_tip_mm);
  return offsets;
}

std::vector<int> sensors_of(const RoomDescription& room) {
  std::vector<int> sensors;
  for (const CoilPlacement& coil : room.instruments.front().coils) sensors.push_back(coil.sensor);
  return sensors;
}

DriverSettings with_mistakes(const std::string& words) {
  return default_settings().with("lambda_mm", 0.0).with("psi_deg", 0.0).with("mistakes", words);
}

TEST(RoomMistakes, AreReadFromWords) {
  const RoomMistakes mistakes =
      parse_mistakes(mistake_words(" registration=6,2.5 offsets=-5\toffset=2,3 offset=4,-1 focal=1.08 "
                                   "pose=3,0.5 clock=-150 field-jump=4,12 "
                                   "averaging=0.7,4 polarity mirrored coil-order coil-direction "));
  EXPECT_EQ(mistakes.registration_mm, 6);
  EXPECT_EQ(mistakes.registration_deg, 2.5);
  EXPECT_EQ(mistakes.offsets_mm, -5);
  EXPECT_EQ(mistakes.offset_mm, (std::map<int, double>{{2, 3}, {4, -1}}));
  EXPECT_EQ(mistakes.focal, 1.08);
  EXPECT_EQ(mistakes.pose_mm, 3);
  EXPECT_EQ(mistakes.pose_deg, 0.5);
  EXPECT_EQ(mistakes.em_stamp_error_s(), 0.15);
  EXPECT_EQ(mistakes.image_stamp_error_s(), 0);
  EXPECT_EQ(mistakes.field_jump_mm, 4);
  EXPECT_EQ(mistakes.field_jump_s, 12);
  EXPECT_EQ(mistakes.averaging, 0.7);
  EXPECT_EQ(mistakes.averaging_limit, 4);
  EXPECT_EQ(parse_mistakes({"averaging=0.7"}).averaging_limit, 0);
  EXPECT_TRUE(mistakes.inverts && mistakes.mirrors && mistakes.reverses_coils && mistakes.flips_coils);
  EXPECT_FALSE(parse_mistakes({"field-jump=4"}).field_jump_s);
}

TEST(RoomMistakes, EveryOneInTheListIsKnown) {
  for (const MistakeHelp& help : mistakes_help()) {
    const std::string name = help.form.substr(0, help.form.find('='));
    EXPECT_EQ(refusal_of({name + "=x"}).find("there is no mistake"), std::string::npos) << name;
    EXPECT_FALSE(help.meaning.empty()) << name;
  }
}

TEST(RoomMistakes, AWrongValueSaysWhatIsExpected) {
  EXPECT_EQ(
      refusal_of({"registration=6"}),
      "mistake \"registration=6\": expected registration=MM,DEG with MM from 0 to 200, DEG from 0 to 180");
  EXPECT_NE(refusal_of({"focal=0.1"}).find("FACTOR from 0.2 to 5"), std::string::npos);
  EXPECT_NE(refusal_of({"focal=5.1"}).find("FACTOR from 0.2 to 5"), std::string::npos);
  EXPECT_NE(refusal_of({"focal=nan"}).find("FACTOR from 0.2 to 5"), std::string::npos);
  EXPECT_NE(refusal_of({"clock=150ms"}).find("MS from -5000 to 5000"), std::string::npos);
  EXPECT_NE(refusal_of({"clock="}).find("MS from"), std::string::npos);
  EXPECT_NE(refusal_of({"clock=1,"}).find("MS from"), std::string::npos);
  EXPECT_NE(refusal_of({"offset=1.5,3"}).find("COIL a whole number"), std::string::npos);
  EXPECT_NE(refusal_of({"polarity=1"}).find("without a value"), std::string::npos);
  EXPECT_NE(refusal_of({"offsets"}).find("expected offsets=MM"), std::string::npos);
  EXPECT_NE(refusal_of({"tilt=3"}).find("there are registration=MM,DEG"), std::string::npos);
  EXPECT_NE(refusal_of({"focal=1.1", "focal=1.2"}).find("twice"), std::string::npos);
  EXPECT_EQ(refusal_of({"offset=1,2", "offset=2,2"}), "");
}

TEST(RoomMistakes, CoilsKeepTheirOrderBehindTheTip) {
  EXPECT_NE(refusal_of({"offsets=-20"}).find("sensor 1"), std::string::npos);
  EXPECT_NE(refusal_of({"offset=1,90"}).find("sensor 2"), std::string::npos);
  EXPECT_NE(refusal_of({"offset=9,5"}).find("no coil has sensor 9"), std::string::npos);
}

TEST(RoomMistakes, ARegistrationIsOffByWhatIsSaidAtTheMiddleOfTheRegion) {
  const RoomDescription room = some_room();
  const RoomDescription described = described_room(room, parse_mistakes({"registration=6,2"}), kDraw);
  const RigidTransform E = described.T_world_em * room.T_world_em.inverse();
  EXPECT_NEAR((E * kDraw.middle_world_mm - kDraw.middle_world_mm).norm(), 6, 1e-9);
  EXPECT_NEAR(Eigen::AngleAxisd(E.linear()).angle(), 2 * std::numbers::pi / 180, 1e-9);
  const RoomDescription other = described_room(room, parse_mistakes({"registration=6,2"}), {8, {5, -20, 60}});
  EXPECT_GT((other.T_world_em.translation() - described.T_world_em.translation()).norm(), 0.1);
}

TEST(RoomMistakes, EachViewIsOffByWhatIsSaidAtTheMiddleOfTheRegionAndItsImagesSayTheSame) {
  RoomDescription room = some_room();
  room.cameras.push_back(room.cameras.front());
  const RoomMistakes mistakes = parse_mistakes({"pose=5,1", "focal=1.1"});
  const RoomDescription described = described_room(room, mistakes, kDraw);
  std::vector<Eigen::Vector3d> shifts_mm;
  for (std::size_t i = 0; i < room.cameras.size(); ++i) {
    const RigidTransform& T_camera_world = room.cameras[i].T_camera_world;
    const RigidTransform E = T_camera_world.inverse() * described.cameras[i].T_camera_world;
    shifts_mm.emplace_back(E * kDraw.middle_world_mm - kDraw.middle_world_mm);
    EXPECT_NEAR(shifts_mm.back().norm(), 5, 1e-9);
    EXPECT_NEAR(Eigen::AngleAxisd(E.linear()).angle(), std::numbers::pi / 180, 1e-9);
    const ViewGeometry said = described_view(geometry_of(room.cameras[i]), mistakes, kDraw, i);
    EXPECT_TRUE(said.T_camera_world().isApprox(described.cameras[i].T_camera_world, 1e-12));
    EXPECT_EQ(said.fx, described.cameras[i].fx);
  }
  EXPECT_GT((shifts_mm[0] - shifts_mm[1]).norm(), 0.1) << "each in a direction of its own";
}

TEST(RoomMistakes, TheRealRoomIsFoundFromItsDescription) {
  const RoomDescription room = some_room();
  const RoomMistakes mistakes = parse_mistakes(
      {"registration=6,2", "offsets=5", "offset=3,-2", "focal=1.08", "pose=5,1", "coil-order"});
  const RoomDescription described = described_room(room, mistakes, kDraw);
  EXPECT_EQ(offsets_of(described), (std::vector<double>{15, 95, 173, 275, 375}));
  EXPECT_EQ(described.cameras.front().fx, 2160);
  const RoomDescription real = real_room(described, mistakes, kDraw);
  EXPECT_TRUE(real.T_world_em.isApprox(room.T_world_em, 1e-12));
  EXPECT_NEAR(real.cameras.front().fy, 2000, 1e-9);
  EXPECT_TRUE(real.cameras.front().T_camera_world.isApprox(room.cameras.front().T_camera_world, 1e-12));
  EXPECT_EQ(offsets_of(real), offsets_of(room));
  EXPECT_EQ(sensors_of(real), (std::vector<int>{5, 4, 3, 2, 1}));
}

TEST(RoomMistakes, WithoutAnyTheRoomIsAsDescribedToTheLastBit) {
  const RoomDescription room = some_room();
  const RoomDescription real = real_room(room, {}, kDraw);
  EXPECT_EQ(real.T_world_em.matrix(), room.T_world_em.matrix());
  EXPECT_EQ(real.cameras.front().fx, room.cameras.front().fx);
  EXPECT_EQ(offsets_of(real), offsets_of(room));
  const SimulatedWorld world(room, with_mistakes(""));
  const SimulatedWorld wrong(room, with_mistakes("registration=6,2 clock=9 coil-order"));
  EXPECT_EQ(world.point(0, 3, 40), wrong.point(0, 3, 40)) << "the truth stays true";
}

/// What the coil of a sensor says of the arch, world frame by the true registration.
CoilSample measured(const std::string& words, int sensor, double t_s) {
  const SimulatedWorld world(paper_room(), with_mistakes(words));
  const SimulatedTracker tracker(world, with_mistakes(words), 0.025);
  const auto& coils = world.room().instruments.front().coils;
  const auto coil = std::find_if(coils.begin(), coils.end(),
                                 [&](const CoilPlacement& placed) { return placed.sensor == sensor; });
  return tracker.measure(world, 0, *coil, 1, t_s);
}

TEST(RoomMistakes, CoilsMeasureWhereTheyAreAndNotWhereTheyAreSaidToBe) {
  const SimulatedWorld world(paper_room(), with_mistakes(""));
  EXPECT_TRUE(measured("offsets=5", 2, 3).p_em_mm.isApprox(world.point(0, 3, 85), 1e-9));
  EXPECT_TRUE(measured("offset=2,-4", 2, 3).p_em_mm.isApprox(world.point(0, 3, 94), 1e-9));
  EXPECT_TRUE(measured("coil-order", 2, 3).p_em_mm.isApprox(world.point(0, 3, 270), 1e-9));
  EXPECT_TRUE(measured("coil-direction", 2, 3).tangent_em.isApprox(-world.tangent(0, 3, 90), 1e-9));
  const RoomDescription real = real_room(paper_room(), parse_mistakes({"registration=6,2"}), {1, {0, 0, 0}});
  EXPECT_TRUE(measured("registration=6,2", 2, 3)
                  .p_em_mm.isApprox(real.T_world_em.inverse() * world.point(0, 3, 90), 1e-9));
}

TEST(RoomMistakes, TheFieldJumpsOnceSmoothlyAndStays) {
  const std::string words = "field-jump=4,12";
  EXPECT_EQ(measured(words, 2, 11.99).p_em_mm, measured("", 2, 11.99).p_em_mm);
  for (const double t_s : {12.0, 13.0, 400.0}) {
    double max_mm = 0;
    for (int sensor = 1; sensor <= 5; ++sensor) {
      const double off_mm = (measured(words, sensor, t_s).p_em_mm - measured("", sensor, t_s).p_em_mm).norm();
      max_mm = std::max(max_mm, off_mm);
    }
    EXPECT_LE(max_mm, 4.5) << t_s;  // 4 in the working volume, which the arch's region is partly beyond
    EXPECT_GT(max_mm, 0.5) << t_s;
  }
  EXPECT_EQ(measured("field-jump=4", 2, 29.9).p_em_mm, measured("", 2, 29.9).p_em_mm) << "half way: 30 s";
  EXPECT_NE(measured("field-jump=4", 2, 30).p_em_mm, measured("", 2, 30).p_em_mm);
}

std::vector<std::uint8_t> picture(const std::string& words) {
  const SimulatedWorld world(paper_room(), with_mistakes(words));
  SimulatedView view(world.room().cameras.front(), world, 1, 2.7);
  std::vector<std::uint8_t> pixels(400 * 600);
  view.render(world, 3, 1, pixels);
  return pixels;
}

TEST(RoomMistakes, PicturesComeAsNegativesOrMirrored) {
  const std::vector<std::uint8_t> right = picture("");
  const std::vector<std::uint8_t> negative = picture("polarity");
  const std::vector<std::uint8_t> mirrored = picture("mirrored");
  for (std::size_t y = 0; y < 600; y += 7) {
    for (std::size_t x = 0; x < 400; x += 3) {
      ASSERT_EQ(negative[400 * y + x], 255 - right[400 * y + x]);
      ASSERT_EQ(mirrored[400 * y + x], right[400 * y + 399 - x]);
    }
  }
  EXPECT_NE(right, mirrored);
}

TEST(RoomMistakes, APictureIsDrawnWithTheTrueFocalLength) {
  RoomDescription described = paper_room();
  described.cameras.front().fx = described.cameras.front().fy = 2500;
  const SimulatedWorld world(described, with_mistakes("focal=1.25 "));
  EXPECT_EQ(world.room().cameras.front().fx, 2000);
  EXPECT_EQ(world.view(world.room().cameras.front(), 3).fx, 2000);
}

}  // namespace
}  // namespace tubed
