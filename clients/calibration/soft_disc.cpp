#include "clients/calibration/soft_disc.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace tubed {

namespace {

/// Order of the fitted numbers.
enum Number { kX, kY, kRadius, kSoftness, kHollow, kContrast, kGrey, kSlopeX, kSlopeY, kNumbers };
using Numbers = Eigen::Matrix<double, kNumbers, 1>;
using Normal = Eigen::Matrix<double, kNumbers, kNumbers>;

struct Pixel {
  double x, y, grey;
};

/// Value and derivative by all numbers at one pixel.
double model(const Numbers& n, const Pixel& pixel, Numbers& J) {
  const double dx = pixel.x - n[kX];
  const double dy = pixel.y - n[kY];
  const double rho = std::sqrt(dx * dx + dy * dy + 1e-12);
  const double r = n[kRadius];
  const double s = n[kSoftness];
  const double q = (rho - r) / (std::numbers::sqrt2 * s);
  const double edge = 0.5 * std::erfc(q);
  const double edge_slope = -std::exp(-q * q) / (std::sqrt(2 * std::numbers::pi) * s);  // d edge / d rho
  const double bowl = 1 - n[kHollow] * rho * rho / (r * r);
  const double d_rho = n[kContrast] * (bowl * edge_slope - 2 * n[kHollow] * rho / (r * r) * edge);
  J[kX] = -d_rho * dx / rho - n[kSlopeX];
  J[kY] = -d_rho * dy / rho - n[kSlopeY];
  J[kRadius] = n[kContrast] * (-bowl * edge_slope + 2 * n[kHollow] * rho * rho / (r * r * r) * edge);
  J[kSoftness] = -n[kContrast] * bowl * edge_slope * (rho - r) / s;
  J[kHollow] = -n[kContrast] * rho * rho / (r * r) * edge;
  J[kContrast] = bowl * edge;
  J[kGrey] = 1;
  J[kSlopeX] = dx;
  J[kSlopeY] = dy;
  return n[kGrey] + n[kSlopeX] * dx + n[kSlopeY] * dy + n[kContrast] * bowl * edge;
}

double sum_of_squares(const std::vector<Pixel>& pixels, const Numbers& n) {
  double sum = 0;
  Numbers J;
  for (const Pixel& pixel : pixels) {
    const double residual = pixel.grey - model(n, pixel, J);
    sum += residual * residual;
  }
  return sum;
}

std::vector<Pixel> pixels_within(const CalibrationPicture& picture, const Eigen::Vector2d& centre_px,
                                 double reach_px, const std::vector<OtherDisc>& others) {
  std::vector<Pixel> pixels;
  const int left = static_cast<int>(std::ceil(centre_px.x() - reach_px));
  const int top = static_cast<int>(std::ceil(centre_px.y() - reach_px));
  const int right = static_cast<int>(std::floor(centre_px.x() + reach_px));
  const int bottom = static_cast<int>(std::floor(centre_px.y() + reach_px));
  if (left < 0 || top < 0 || right >= picture.width || bottom >= picture.height) return pixels;
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const Eigen::Vector2d at(x, y);
      const bool is_other = std::any_of(others.begin(), others.end(), [&](const OtherDisc& other) {
        return (at - other.p_image_px).norm() < other.radius_px;
      });
      if (!is_other && (at - centre_px).norm() <= reach_px) {
        pixels.push_back({static_cast<double>(x), static_cast<double>(y), picture.at(x, y)});
      }
    }
  }
  return pixels;
}

/// Sum of squares about the best even slope.
double squares_about_slope(const std::vector<Pixel>& pixels) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double squares = 0;
  for (const Pixel& pixel : pixels) {
    const Eigen::Vector3d row(1, pixel.x - pixels.front().x, pixel.y - pixels.front().y);
    A += row * row.transpose();
    b += row * (pixel.grey - pixels.front().grey);
    squares += (pixel.grey - pixels.front().grey) * (pixel.grey - pixels.front().grey);
  }
  return squares - b.dot(A.ldlt().solve(b));
}

/// Keeps numbers where the model means something.
Numbers confined(Numbers n, double radius_px) {
  n[kRadius] = std::clamp(n[kRadius], 0.4 * radius_px, 2.5 * radius_px);
  n[kSoftness] = std::clamp(n[kSoftness], 0.35, 0.6 * radius_px + 0.6);
  n[kHollow] = std::clamp(n[kHollow], 0.0, 0.8);
  return n;
}

struct Fit {
  Numbers numbers;
  double squares;
  bool settled;
};

/// Small discs do not show how their edge is made: what only their form depends on is pulled to the usual.
Normal priors(double radius_px, double contrast2) {
  Normal prior = Normal::Zero();
  const double weight = contrast2 * std::min(1.0, 4 / (radius_px * radius_px));
  prior(kSoftness, kSoftness) = 0.05 * weight;
  prior(kHollow, kHollow) = 0.1 * weight;
  return prior;
}

Fit levenberg_marquardt(const std::vector<Pixel>& pixels, const Numbers& first, double radius_px) {
  constexpr int kMaxRounds = 60;
  Numbers usual = first;
  const Normal prior = priors(radius_px, first[kContrast] * first[kContrast]);
  const auto cost = [&](const Numbers& n) {
    return sum_of_squares(pixels, n) + (n - usual).dot(prior * (n - usual));
  };
  Numbers n = first;
  double best = cost(n);
  double damping = 1e-3;
  for (int round = 0; round < kMaxRounds; ++round) {
    Normal A = prior;
    Numbers b = prior * (usual - n);
    Numbers J;
    for (const Pixel& pixel : pixels) {
      const double residual = pixel.grey - model(n, pixel, J);
      A += J * J.transpose();
      b += J * residual;
    }
    Normal damped = A;
    damped.diagonal() += damping * A.diagonal() + Numbers::Constant(1e-12);
    const Numbers next = confined(n + damped.ldlt().solve(b), radius_px);
    const double squares = cost(next);
    if (!(squares < best)) {
      damping *= 8;
      if (damping > 1e8) return {n, sum_of_squares(pixels, n), true};
      continue;
    }
    const bool is_settled = (next - n).head<2>().norm() < 1e-5 && best - squares < 1e-7 * best;
    n = next;
    best = squares;
    damping = std::max(1e-9, damping / 6);
    if (is_settled) return {n, sum_of_squares(pixels, n), true};
  }
  return {n, sum_of_squares(pixels, n), false};
}

double centre_sigma(const std::vector<Pixel>& pixels, const Numbers& n, double noise) {
  Normal A = Normal::Zero();
  Numbers J;
  for (const Pixel& pixel : pixels) {
    model(n, pixel, J);
    A += J * J.transpose();
  }
  // The centre is all but uncorrelated with what has the disc's symmetry.
  const Eigen::Matrix2d centre = A.topLeftCorner<2, 2>().inverse();
  return noise * std::sqrt(centre.trace() / 2);
}

}  // namespace

std::optional<SoftDisc> fit_soft_disc(const CalibrationPicture& picture, const Eigen::Vector2d& centre_px,
                                      double radius_px, double contrast,
                                      const std::vector<OtherDisc>& others) {
  Numbers n = Numbers::Zero();
  n[kX] = centre_px.x();
  n[kY] = centre_px.y();
  n[kRadius] = radius_px;
  n[kSoftness] = 0.8;
  n[kHollow] = 0.2;
  n[kContrast] = contrast;
  std::vector<Pixel> pixels;
  Fit fit{};
  constexpr int kPasses = 2;  // the second with pixels around what the first found
  for (int pass = 0; pass < kPasses; ++pass) {
    const double reach_px = 1.35 * n[kRadius] + 3;
    pixels = pixels_within(picture, n.head<2>(), reach_px, others);
    if (pixels.size() < 2 * kNumbers) return std::nullopt;
    double sum = 0;
    for (const Pixel& pixel : pixels) sum += pixel.grey;
    n[kGrey] = pass == 0 ? sum / static_cast<double>(pixels.size()) - contrast * 0.4 : n[kGrey];
    fit = levenberg_marquardt(pixels, n, n[kRadius]);
    n = fit.numbers;
    const double strayed_px = (n.head<2>() - centre_px).norm();
    if (!n.allFinite() || strayed_px > std::max(1.5, radius_px)) return std::nullopt;
  }
  if (!fit.settled) return std::nullopt;
  SoftDisc disc;
  disc.p_image_px = n.head<2>();
  disc.radius_px = n[kRadius];
  disc.softness_px = n[kSoftness];
  disc.hollow = n[kHollow];
  disc.contrast = n[kContrast];
  disc.noise = std::sqrt(fit.squares / static_cast<double>(pixels.size() - kNumbers));
  const double before = squares_about_slope(pixels);
  disc.explained = before > 0 ? 1 - fit.squares / before : 0;
  disc.sigma_px = centre_sigma(pixels, n, disc.noise);
  return disc;
}

}  // namespace tubed
