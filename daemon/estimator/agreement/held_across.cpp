#include "daemon/estimator/agreement/held_across.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "idl/geometry/squared.hpp"

namespace tubed {

namespace {

constexpr double kStep_mm = 2;
constexpr std::ptrdiff_t kAround = 5;  // steps to either side whose lines speak of a place together
constexpr double kTells_mm = 2.5;  // a line that is less sure shows no tube, and neighbours do not add to it
constexpr double kBest_mm = 0.15;  // what an image leaves open across itself
constexpr double kLostPerStep_mm = 0.06;  // 3 mm in 100 mm, in which a tube is bent to anywhere

}  // namespace

HeldAcross::HeldAcross(double length_mm)
    : information_(static_cast<std::size_t>(std::ceil(std::max(length_mm, 0.0) / kStep_mm)) + 1),
      sigma_mm_(information_.size(), std::numeric_limits<double>::infinity()) {}

void HeldAcross::record(const ViewConstraints& view, const ConfirmedShape& shape) {
  const auto steps = static_cast<std::ptrdiff_t>(information_.size());
  std::ranges::fill(information_, 0);
  const CubicBasis middle = shape.spline.basis(shape.spline.length_mm() / 2);
  const auto projection = view.camera->project(combine(shape.C, middle.first, middle.value));
  const double px_per_mm = projection ? projection->J_image_world.norm() / std::numbers::sqrt2 : 1;
  double before_mm = 0;
  for (int i = 0; i < view.count && view.lines[i].s_mm >= before_mm; ++i) {
    before_mm = view.lines[i].s_mm;
    if (view.lines[i].variance_px2 > squared(kTells_mm * px_per_mm)) continue;
    const auto step = static_cast<std::ptrdiff_t>(std::lround(before_mm / kStep_mm));
    information_[static_cast<std::size_t>(std::min(step, steps - 1))] += 1 / view.lines[i].variance_px2;
  }
  for (std::ptrdiff_t step = 0; step < steps; ++step) {
    double around = 0;
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(step - kAround, 0);
         i <= std::min(step + kAround, steps - 1); ++i) {
      around += information_[static_cast<std::size_t>(i)];
    }
    sigma_mm_[static_cast<std::size_t>(step)] = std::max(kBest_mm, 1 / std::sqrt(around) / px_per_mm);
  }
  for (std::size_t i = 1; i < sigma_mm_.size(); ++i) {
    sigma_mm_[i] = std::min(sigma_mm_[i], sigma_mm_[i - 1] + kLostPerStep_mm);
  }
  for (std::size_t i = sigma_mm_.size() - 1; i > 0; --i) {
    sigma_mm_[i - 1] = std::min(sigma_mm_[i - 1], sigma_mm_[i] + kLostPerStep_mm);
  }
}

double HeldAcross::sigma_mm(double s_mm) const {
  const double step = std::clamp(s_mm / kStep_mm, 0.0, static_cast<double>(sigma_mm_.size() - 1));
  return sigma_mm_[static_cast<std::size_t>(std::lround(step))];
}

}  // namespace tubed
