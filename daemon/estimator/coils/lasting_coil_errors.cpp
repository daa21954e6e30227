#include "daemon/estimator/coils/lasting_coil_errors.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/estimator/coils/shared_coil_errors.hpp"

namespace tubed {

namespace {

constexpr double kNegligibleShare = 0.25;  // of the variance of coils' errors, that stays
// A coil's lasting error changes as the coil moves through the field, and does not stay for ever: images that
// led the shape away taught a false one.
constexpr double kOwnLength_mm = 1000;
constexpr double kOwnMemory_s = 30;
// What all coils share is the registration's, and of a field that bends slowly: what a view from another
// direction once showed of it holds until somebody moves the tracker.
constexpr double kSharedLength_mm = 10000;
constexpr double kSharedMemory_s = 600;

double kept_of(double way_mm, double length_mm, double dt_s, double memory_s) {
  return std::exp(-way_mm / length_mm - dt_s / memory_s);
}

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

// SharedCoilErrors: of the errors against each other P becomes A (P - S) A^T + S, of errors against
// everything else A P.
void LastingCoilErrors::age_positions(double dt_s, const std::array<Eigen::Vector3d, kMaxCoils>& before_mm,
                                      int coil_count, const TubeMap& map, TubeGaussian& tube,
                                      Eigen::MatrixXd& scratch) const {
  const auto coils = static_cast<std::size_t>(coil_count);
  std::array<double, kMaxCoils> kept_own{};
  double way_mm = 0;  // in the mean
  for (std::size_t i = 0; i < coils; ++i) {
    const double coil_way_mm = (places_mm_[i] - before_mm[i]).norm();
    kept_own[i] = kept_of(coil_way_mm, kOwnLength_mm, dt_s, kOwnMemory_s);
    way_mm += coil_way_mm / coil_count;
  }
  const double kept_shared = kept_of(way_mm, kSharedLength_mm, dt_s, kSharedMemory_s);
  const SharedCoilErrors shared({places_mm_.data(), coils});
  const auto age = [&](auto X) { shared.age(kept_shared, {kept_own.data(), coils}, X, scratch); };
  const Eigen::Index first = 3 * Eigen::Index{map.columns().position_error(0)};
  const Eigen::Index size = 3 * Eigen::Index{coil_count};
  age(Eigen::Map<Eigen::VectorXd>(tube.C.data() + first, size));
  age(Eigen::Map<Eigen::VectorXd>(tube.m.data() + first, size));
  auto errors = tube.P.block(first, first, size, size);
  errors.diagonal().array() -= position_mm_ * position_mm_;
  age(tube.P.middleRows(first, size));
  errors.transposeInPlace();
  age(tube.P.block(first, first, size, size));
  errors.diagonal().array() += position_mm_ * position_mm_;
  const Eigen::Index end = first + size;
  const Eigen::Index further = tube.P.cols() - end;
  tube.P.block(0, first, first, size) = tube.P.block(first, 0, size, first).transpose();
  tube.P.block(end, first, further, size) = tube.P.block(first, end, size, further).transpose();
}

// Each by itself: what a turn of the registration does to them is less than they err.
void LastingCoilErrors::age_tangent(double kept, int column, TubeGaussian& tube) const {
  tube.C.col(column) *= kept;
  tube.m.col(column) *= kept;
  tube.P.middleRows<3>(3 * column) *= kept;
  tube.P.middleCols<3>(3 * column) *= kept;
  tube.P.block<3, 3>(3 * column, 3 * column).diagonal().array() += (1 - kept * kept) * tangent_ * tangent_;
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
  const int coil_count = static_cast<int>(instrument.coils.size());
  if (coil_count > 0) age_positions(dt_s, before_mm, coil_count, map, tube, scratch);
  const auto correct = [&](int column, double sigma, double was, double was_min) {
    tube.P.block<3, 3>(3 * column, 3 * column).diagonal().array() += std::max(0.0, sigma * sigma - was * was);
    if (sigma < was_min) {
      tube.tighten(column, 1 / (1 / (sigma * sigma) - 1 / (was_min * was_min)), scratch);
    }
  };
  for (int i = 0; i < coil_count; ++i) {
    const auto coil = static_cast<std::size_t>(i);
    const double way_mm = (places_mm_[coil] - before_mm[coil]).norm();
    age_tangent(kept_of(way_mm, kOwnLength_mm, dt_s, kOwnMemory_s), map.columns().tangent_error(i), tube);
    correct(map.columns().position_error(i), position_mm_, was_position_mm, was_min_position_mm);
    correct(map.columns().tangent_error(i), tangent_, was_tangent, was_min_tangent);
  }
}

void LastingCoilErrors::reset() {
  noise_.reset();
  scale_.reset();
}

}  // namespace tubed
