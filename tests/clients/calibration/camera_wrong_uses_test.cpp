// What people get wrong when they calibrate a camera, and the words that meet it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "clients/calibration/camera_calibration.hpp"
#include "clients/calibration/simulated_phantom.hpp"

namespace tubed {
namespace {

/// The first `count` directions of the usual C-arm.
SimulatedCArm c_arm(std::size_t count) {
  SimulatedCArm arm = usual_c_arm();
  arm.angles.resize(count);
  arm.exposure.seed = 77;
  return arm;
}

std::vector<CalibrationPicture> pictures_of(const SimulatedCArm& arm,
                                            const BallPhantom& phantom = helix_phantom()) {
  std::vector<CalibrationPicture> pictures;
  for (std::size_t i = 0; i < arm.angles.size(); ++i) pictures.push_back(picture_at(arm, phantom, i));
  return pictures;
}

const std::vector<CalibrationPicture>& two_pictures() {
  static const std::vector<CalibrationPicture> pictures = pictures_of(c_arm(2));
  return pictures;
}

CameraSettings camera_a() {
  CameraSettings settings;
  settings.camera = "A";
  return settings;
}

template <typename Change>
BallPhantom changed(Change change) {
  BallPhantom phantom = helix_phantom();
  for (std::size_t i = 0; i < phantom.balls.size(); ++i) change(i, phantom.balls[i]);
  return phantom;
}

template <typename Change>
std::vector<CalibrationPicture> changed_pictures(Change change) {
  std::vector<CalibrationPicture> pictures = two_pictures();
  for (CalibrationPicture& picture : pictures) {
    for (float& pixel : picture.pixels) pixel = change(pixel);
  }
  return pictures;
}

/// How it ends: refused, BAD (nothing is offered), doubtful, or good.
enum class End { kRefused, kBad, kDoubtful };

struct WrongUse {
  const char* what;
  std::vector<CalibrationPicture> pictures;
  BallPhantom phantom;
  CameraSettings settings;
  End end;
  const char* words;
};

void expect_met(const WrongUse& use) {
  CameraFindings findings;
  try {
    findings = calibrate_with_balls(use.pictures, use.phantom, use.settings);
  } catch (const PhantomError& error) {
    EXPECT_EQ(use.end, End::kRefused) << use.what << ": " << error.what();
    EXPECT_NE(std::string(error.what()).find(use.words), std::string::npos)
        << use.what << ": " << error.what();
    return;
  }
  EXPECT_NE(use.end, End::kRefused) << use.what;
  std::string all;
  bool is_met = false;
  for (const CameraStatement& statement : findings.statements) {
    const bool is_worse =
        statement.verdict == (use.end == End::kBad ? ReportVerdict::kBad : ReportVerdict::kDoubtful);
    is_met = is_met || (is_worse && statement.words.find(use.words) != std::string::npos);
    all += statement.words + "\n";
  }
  EXPECT_TRUE(is_met) << use.what << ":\n" << all;
  EXPECT_EQ(findings.is_usable(), use.end == End::kDoubtful) << use.what << ":\n" << all;
}

CameraSettings with(void (*change)(CameraSettings&)) {
  CameraSettings settings = camera_a();
  change(settings);
  return settings;
}

TEST(CameraWrongUses, ImagesThatAreNotTheCamerasAreMetWithWords) {
  const BallPhantom helix = helix_phantom();
  CalibrationPicture empty = two_pictures()[0];
  std::fill(empty.pixels.begin(), empty.pixels.end(), 2000.0F);
  CameraCalibration other_size;
  other_size.width = 1024;
  other_size.height = 1024;
  CameraSettings configured = camera_a();
  configured.configured = other_size;
  const float white = *std::max_element(two_pictures()[0].pixels.begin(), two_pictures()[0].pixels.end());
  const auto negative = [white](float pixel) { return white - pixel; };
  for (const WrongUse& use : std::vector<WrongUse>{
           {"no image", {}, helix, camera_a(), End::kRefused, "no image was given"},
           {"an image without balls", {empty}, helix, camera_a(), End::kRefused, "balls found"},
           {"another size than configured",
            {two_pictures()[0]},
            helix,
            configured,
            End::kRefused,
            "neither scaled nor cropped"},
           {"bright balls where dark ones are asked for", changed_pictures(negative), helix,
            with([](CameraSettings& s) { s.look.polarity = BallLook::Polarity::kDark; }), End::kRefused,
            "--balls bright"},
           {"saturated", changed_pictures([white](float pixel) { return std::min(pixel, 0.5F * white); }),
            helix, camera_a(), End::kRefused, "the image is saturated"}}) {
    expect_met(use);
  }
}

TEST(CameraWrongUses, APhantomsFileThatIsWrongIsMetWithWords) {
  const BallPhantom third_negated = changed([](std::size_t i, PhantomBall& ball) {
    if (i % 3 == 1) ball.p_phantom_mm.z() *= -1;
  });
  BallPhantom exchanged = helix_phantom();
  std::swap(exchanged.balls[6].p_phantom_mm, exchanged.balls[7].p_phantom_mm);
  const BallPhantom centimetres = changed([](std::size_t, PhantomBall& ball) {
    ball.p_phantom_mm *= 0.1;
    ball.diameter_mm *= 0.1;
  });
  const BallPhantom plane = changed([](std::size_t, PhantomBall& ball) { ball.p_phantom_mm.z() = 0; });
  const BallPhantom turned_axes = changed([](std::size_t i, PhantomBall& ball) {
    if (i % 5 == 1) std::swap(ball.p_phantom_mm.x(), ball.p_phantom_mm.y());
  });
  BallPhantom upside_down = helix_phantom();
  upside_down.T_world_phantom.linear() = Eigen::Vector3d(1, -1, -1).asDiagonal();
  CameraSettings configured = camera_a();
  configured.configured = camera_at(c_arm(2), 0);
  for (const WrongUse& use : std::vector<WrongUse>{
           {"a third with z negated", two_pictures(), third_negated, camera_a(), End::kBad,
            "z has the wrong sign of S"},
           {"two balls exchanged", two_pictures(), exchanged, camera_a(), End::kBad,
            "L7 and S8 are exchanged"},
           {"x and y exchanged in some rows", two_pictures(), turned_axes, camera_a(), End::kBad,
            "x and y are exchanged of "},
           {"centimetres", two_pictures(), centimetres, camera_a(), End::kBad, "not in mm"},
           {"a plane in two images", two_pictures(), plane, camera_a(), End::kRefused, "lie in one plane"},
           {"upside down in the world", two_pictures(), upside_down, configured, End::kDoubtful, "upside"}}) {
    expect_met(use);
  }
}

TEST(CameraWrongUses, AnglesAndDistancesThatDoNotFitAreMetWithWords) {
  const BallPhantom helix = helix_phantom();
  CameraSettings angles = camera_a();
  angles.angles = c_arm(2).angles;
  CameraSettings with_pitch = angles;
  with_pitch.pixel_pitch_mm = 0.6;
  CameraSettings three = with_pitch;
  three.angles.push_back({0, 0});
  CameraSettings sid = with_pitch;
  sid.source_detector_mm = 980;
  CameraSettings alike = with_pitch;
  SimulatedCArm one_direction = c_arm(2);
  one_direction.angles[1] = {3, 0};
  alike.angles = one_direction.angles;
  CameraSettings other_sign = with_pitch;
  other_sign.angles[1].primary_deg *= -1;
  for (const WrongUse& use : std::vector<WrongUse>{
           {"angles of more images", two_pictures(), helix, three, End::kRefused, "give one pair an image"},
           {"angles without a pitch", two_pictures(), helix, angles, End::kDoubtful, "no --pitch"},
           {"a distance that does not fit", two_pictures(), helix, sid, End::kBad, "the image asks for"},
           {"all from one direction", pictures_of(one_direction), helix, alike, End::kDoubtful,
            "from one direction"},
           {"LAO taken for RAO", two_pictures(), helix, other_sign, End::kBad, "they fit as"}}) {
    expect_met(use);
  }
}

}  // namespace
}  // namespace tubed
