#include "clients/calibration/ball_phantom.hpp"

#include <toml++/toml.h>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <set>
#include <sstream>

namespace tubed {

namespace {

std::string in_mm(double value) {
  std::ostringstream text;
  text << std::setprecision(4) << value << " mm";
  return text.str();
}

PhantomBall ball_from(const toml::node& node, const std::string& where) {
  const toml::array* const row = node.as_array();
  const auto number = [&](std::size_t i) { return (*row)[i].value<double>(); };
  if (row == nullptr || row->size() != 5 || !(*row)[0].value<std::string>() || !number(1) || !number(2) ||
      !number(3) || !number(4)) {
    throw PhantomError(where + ": expected [\"name\", x, y, z, diameter] with four numbers in mm");
  }
  PhantomBall ball{*(*row)[0].value<std::string>(), {*number(1), *number(2), *number(3)}, *number(4)};
  if (!ball.p_phantom_mm.allFinite() || !(ball.diameter_mm > 0) || !std::isfinite(ball.diameter_mm)) {
    throw PhantomError(where + ": place and diameter have to be numbers, the diameter above 0");
  }
  return ball;
}

RigidTransform transform_from(const toml::node& node, const std::string& file) {
  Eigen::Matrix4d matrix;
  const toml::array* const rows = node.as_array();
  for (std::size_t i = 0; i < 4; ++i) {
    const toml::array* const row = rows != nullptr && rows->size() == 4 ? (*rows)[i].as_array() : nullptr;
    for (std::size_t j = 0; j < 4; ++j) {
      const auto value =
          row != nullptr && row->size() == 4 ? (*row)[j].value<double>() : std::optional<double>();
      if (!value) throw PhantomError(file + ": T_world_phantom: expected 4 rows of 4 numbers");
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = *value;
    }
  }
  std::string why;
  constexpr double kTolerance = 1e-4;
  const auto transform = rigid_from_matrix(matrix, kTolerance, why);
  if (!transform) throw PhantomError(file + ": T_world_phantom: " + why);
  return *transform;
}

void check_pairs(const BallPhantom& phantom, const std::string& file) {
  std::set<std::string> names;
  for (std::size_t i = 0; i < phantom.balls.size(); ++i) {
    const PhantomBall& ball = phantom.balls[i];
    if (!names.insert(ball.name).second) {
      throw PhantomError(file + ": two balls are named \"" + ball.name + "\"");
    }
    for (std::size_t j = 0; j < i; ++j) {
      const PhantomBall& other = phantom.balls[j];
      const double distance_mm = (ball.p_phantom_mm - other.p_phantom_mm).norm();
      if (distance_mm < (ball.diameter_mm + other.diameter_mm) / 2) {
        throw PhantomError(file + ": balls \"" + other.name + "\" and \"" + ball.name + "\" are " +
                           in_mm(distance_mm) + " apart, so that one is within the other");
      }
    }
  }
}

/// Phantoms fit onto a table and into a detector's field; balls can be bought.
void check_units(const BallPhantom& phantom, const std::string& file) {
  double diameter_mm = 0;
  for (const PhantomBall& ball : phantom.balls) diameter_mm = std::max(diameter_mm, ball.diameter_mm);
  const double across_mm = 4 * phantom.extents_mm()[0];  // about its length
  if (across_mm < 15 || diameter_mm < 0.3) {
    throw PhantomError(file + ": the phantom is about " + in_mm(across_mm) + " long and its largest ball " +
                       in_mm(diameter_mm) +
                       " wide; all numbers are mm (are these inches or metres? 1 inch is 25.4 mm)");
  }
  if (across_mm > 1500 || diameter_mm > 40) {
    throw PhantomError(file + ": the phantom is about " + in_mm(across_mm) + " long and its largest ball " +
                       in_mm(diameter_mm) + " wide; all numbers are mm (are these micrometres?)");
  }
}

}  // namespace

Eigen::Vector3d BallPhantom::extents_mm() const {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const PhantomBall& ball : balls) mean += ball.p_phantom_mm;
  mean /= static_cast<double>(balls.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const PhantomBall& ball : balls) {
    spread += (ball.p_phantom_mm - mean) * (ball.p_phantom_mm - mean).transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread / static_cast<double>(balls.size()));
  return axes.eigenvalues().reverse().cwiseMax(0).cwiseSqrt();
}

bool BallPhantom::is_plane() const {
  const Eigen::Vector3d extents = extents_mm();
  return extents[2] < 0.02 * extents[0];
}

BallPhantom parse_ball_phantom(std::string_view text, const std::string& file) {
  BallPhantom phantom;
  try {
    const toml::table table = toml::parse(text, file);
    if (table["format"].value<std::int64_t>() != 1) {
      throw PhantomError(file + ": is no phantom: expected format = 1");
    }
    phantom.name = table["name"].value_or(std::string("phantom"));
    const toml::array* const balls = table["balls"].as_array();
    if (balls == nullptr)
      throw PhantomError(file + ": has no list balls = [[\"L1\", x, y, z, diameter], ...]");
    for (std::size_t i = 0; i < balls->size(); ++i) {
      phantom.balls.push_back(ball_from((*balls)[i], file + ": ball " + std::to_string(i + 1)));
    }
    if (table.contains("T_world_phantom")) {
      phantom.T_world_phantom = transform_from(*table.get("T_world_phantom"), file);
    }
  } catch (const toml::parse_error& error) {
    std::ostringstream where;
    where << file << ":" << error.source().begin.line << ":" << error.source().begin.column << ": "
          << error.description();
    throw PhantomError(where.str());
  }
  constexpr std::size_t kMinBalls = 6;
  if (phantom.balls.size() < kMinBalls) {
    throw PhantomError(file + ": has " + std::to_string(phantom.balls.size()) +
                       " balls; focal length and pose take 6 at least, and 20 or more make them good");
  }
  check_units(phantom, file);
  check_pairs(phantom, file);
  return phantom;
}

BallPhantom read_ball_phantom(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw PhantomError(file.string() + ": cannot be read; give the phantom's file");
  return parse_ball_phantom(text.str(), file.string());
}

std::string to_toml(const BallPhantom& phantom) {
  std::ostringstream text;
  text << std::setprecision(9) << "format = 1\nname = \"" << phantom.name << "\"\n";
  if (!phantom.T_world_phantom.isApprox(RigidTransform::Identity())) {
    const Eigen::Matrix4d& T = phantom.T_world_phantom.matrix();
    text << "T_world_phantom = [";
    for (int i = 0; i < 4; ++i) {
      text << (i == 0 ? "[" : ", [") << T(i, 0) << ", " << T(i, 1) << ", " << T(i, 2) << ", " << T(i, 3)
           << "]";
    }
    text << "]\n";
  }
  text << "balls = [  # name, x, y, z, diameter: mm, in the phantom's frame\n";
  for (const PhantomBall& ball : phantom.balls) {
    text << "  [\"" << ball.name << "\", " << ball.p_phantom_mm.x() << ", " << ball.p_phantom_mm.y() << ", "
         << ball.p_phantom_mm.z() << ", " << ball.diameter_mm << "],\n";
  }
  text << "]\n";
  return text.str();
}

BallPhantom helix_phantom() {
  constexpr int kBalls = 44;
  constexpr double kRadius_mm = 65, kHeight_mm = 150, kTurns = 3;
  constexpr double kLarge_mm = 4, kSmall_mm = 2;
  const std::set<int> large{0, 2, 5, 6, 11, 15, 20, 22, 29, 33, 40, 43};
  BallPhantom phantom;
  phantom.name = "helix-44";
  for (int i = 0; i < kBalls; ++i) {
    const double part = static_cast<double>(i) / (kBalls - 1);
    const double angle = 2 * std::numbers::pi * kTurns * part;
    const bool is_large = large.count(i) > 0;
    phantom.balls.push_back(
        {(is_large ? "L" : "S") + std::to_string(i + 1),
         {kRadius_mm * std::cos(angle), kRadius_mm * std::sin(angle), kHeight_mm * (part - 0.5)},
         is_large ? kLarge_mm : kSmall_mm});
  }
  return phantom;
}

}  // namespace tubed
