#include "daemon/estimator/lasting_coil_errors.hpp"

#include <algorithm>
#include <cmath>

namespace tubed {

namespace {

constexpr double kNegligibleShare = 0.25;  // of the variance of coils' errors, that stays
// A coil's lasting error changes as the coil moves through the field.
constexpr double kErrorLength_mm = 1000;
constexpr double kErrorMemory_s = 10;  // so that a drift does not stay for ever

}  // namespace

double LastingCoilErrors::share() const {
  const double share = position_mm_ / scale_.position_mm();
  return share * share;
}

void LastingCoilErrors::begin() {
  began_with_known_noise_ = noise_.known();
  position_mm_ = noise_.lasting_position_mm(scale_.position_mm());
  tangent_ = noise_.lasting_tangent(scale_.tangent());
  min_position_mm_ = position_mm_;
  min_tangent_ = tangent_;
}

LastingCoilErrors::Learnt LastingCoilErrors::learn() {
  if (!noise_.known() || began_with_known_noise_) {
    return Learnt::kNothing;
  }
  const double whole_mm = scale_.position_mm();
  const double lasting_mm = noise_.lasting_position_mm(whole_mm);
  if (lasting_mm * lasting_mm > kNegligibleShare * whole_mm * whole_mm) {
    return Learnt::kPartStays;
  }
  began_with_known_noise_ = true;
  return Learnt::kAllIsNoise;
}

void LastingCoilErrors::place(const InstrumentDescription& instrument, const UniformCubicBSpline& spline,
                              const Eigen::Matrix3Xd& C) {
  for (std::size_t i = 0; i < instrument.coils.size(); ++i) {
    const CubicBasis basis = spline.basis(instrument.coils[i].offset_from_tip_mm);
    places_mm_[i] = combine(C, basis.first, basis.value);
  }
}

// If more of the error turns out to stay than was thought, that much is added; if less than ever, each coil's
// error is known to be as much smaller. Not if less than a moment ago: a figure that wavers would tell the
// same again and again.
void LastingCoilErrors::age(double dt_s, const InstrumentDescription& instrument, const TubeMap& map,
                            TubeGaussian& tube, Eigen::MatrixXd& scratch) {
  const double was_position_mm = position_mm_;
  const double was_tangent = tangent_;
  position_mm_ = noise_.lasting_position_mm(scale_.position_mm());
  tangent_ = noise_.lasting_tangent(scale_.tangent());
  const double was_min_position_mm = min_position_mm_;
  const double was_min_tangent = min_tangent_;
  min_position_mm_ = std::min(min_position_mm_, position_mm_);
  min_tangent_ = std::min(min_tangent_, tangent_);
  const std::array<Eigen::Vector3d, kMaxCoils> before_mm = places_mm_;
  place(instrument, map.spline(), tube.C);
  for (std::size_t i = 0; i < instrument.coils.size(); ++i) {
    const double kept =
        std::exp(-(places_mm_[i] - before_mm[i]).norm() / kErrorLength_mm - dt_s / kErrorMemory_s);
    const auto age_column = [&](int column, double sigma, double was, double was_min) {
      tube.C.col(column) *= kept;
      tube.m.col(column) *= kept;
      tube.P.middleRows<3>(3 * column) *= kept;
      tube.P.middleCols<3>(3 * column) *= kept;
      tube.P.block<3, 3>(3 * column, 3 * column).diagonal().array() +=
          (1 - kept * kept) * sigma * sigma + std::max(0.0, sigma * sigma - was * was);
      if (sigma < was_min) {
        tube.tighten(column, 1 / (1 / (sigma * sigma) - 1 / (was_min * was_min)), scratch);
      }
    };
    age_column(map.position_error_column(static_cast<int>(i)), position_mm_, was_position_mm,
               was_min_position_mm);
    age_column(map.tangent_error_column(static_cast<int>(i)), tangent_, was_tangent, was_min_tangent);
  }
}

void LastingCoilErrors::reset() {
  noise_.reset();
  scale_.reset();
}

}  // namespace tubed
