#include "daemon/estimator/algebra/line_kernels.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <random>
#include <vector>

namespace tubed {
namespace {

CameraCalibration distorted_camera() {
  CameraCalibration camera;
  camera.width = 400;
  camera.height = 600;
  camera.fx = 2000;
  camera.fy = 1990;
  camera.cx = 203;
  camera.cy = 297;
  camera.distortion = {0.3, -0.2, 0.01, -0.02, 0.4};
  camera.T_camera_world.linear() =
      Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  camera.T_camera_world.translation() = Eigen::Vector3d(5, -7, 900);
  return camera;
}

struct Lines {
  explicit Lines(std::size_t line_count) : count(line_count) {
    for (auto& values : in) values.resize(count + kLineLanes);
    for (auto& values : out) values.resize(count + kLineLanes);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> even(-1, 1);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < 3; ++k) in[k][i] = 100 * even(random);
      for (std::size_t k = 3; k < 6; ++k) in[k][i] = even(random);
    }
  }
  void project(const CameraCalibration& camera) {
    project_to_lines(
        LineCamera(camera),
        {count, in[0].data(), in[1].data(), in[2].data(), in[3].data(), in[4].data(), in[5].data()},
        {out[0].data(), out[1].data(), out[2].data(), out[3].data()});
  }
  std::size_t count;
  std::array<std::vector<double>, 6> in;
  std::array<std::vector<double>, 4> out;
};

TEST(LineKernels, ResidualAndGradientAreThoseOfTheCamera) {
  const Camera camera(distorted_camera());
  for (const std::size_t count : {1U, 7U, 8U, 9U, 30U}) {
    Lines lines(count);
    lines.project(camera.calibration());
    for (std::size_t i = 0; i < count; ++i) {
      const auto projection = camera.project({lines.in[0][i], lines.in[1][i], lines.in[2][i]});
      const Eigen::Vector2d normal(lines.in[3][i], lines.in[4][i]);
      const Eigen::Vector3d gradient = projection->J_image_world.transpose() * normal;
      EXPECT_NEAR(lines.out[0][i], normal.dot(projection->p_image_px) - lines.in[5][i], 1e-9) << i;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(lines.out[1 + axis][i], gradient[static_cast<Eigen::Index>(axis)], 1e-12) << i;
      }
    }
  }
}

TEST(LineKernels, APointBehindTheCameraPullsNothing) {
  Lines lines(3);
  lines.in[2][1] = -5000;
  lines.project(distorted_camera());
  for (const auto& values : lines.out) EXPECT_EQ(values[1], 0);
  EXPECT_NE(lines.out[0][0], 0);
  EXPECT_NE(lines.out[0][2], 0);
}

TEST(LineKernels, OuterProductsAreSummedUp) {
  constexpr int kRows = 11;
  const Eigen::Matrix<double, 8, kRows> outer = Eigen::Matrix<double, 8, kRows>::Random();
  const Eigen::Matrix<double, 12, kRows> products = Eigen::Matrix<double, 12, kRows>::Random();
  Eigen::Matrix<double, 8, 10> sums = Eigen::Matrix<double, 8, 10>::Ones();
  const Eigen::Matrix<double, 8, 10> expected = sums + outer * products.topRows<10>().transpose();
  add_outer_products(outer.data(), products.data(), kRows, sums.data());
  EXPECT_LT((sums - expected).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace tubed
