#include "daemon/estimator/paper/paper_image_mle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "daemon/model/dense_solver.hpp"
#include "idl/geometry/image_mask.hpp"

namespace tubed {

namespace {

constexpr double kVertexSpacing_mm = 2.0;
constexpr double kBandReach_px = 14.0;       // half width of Omega beyond the tube
constexpr double kShortest_px_per_mm = 0.2;  // a tube that runs toward the source has no side to look to
constexpr double kViewMargin_px = 3.0;
constexpr int kMinVertices = 10;  // in view; with fewer an image says nothing
constexpr double kTransition_px = 0.7;
constexpr std::array<int, 2> kStartDivisors = {1, 2};
constexpr int kJudgingReach_px = 4;
// Errors of the shape between coils fade over about half their distance.
constexpr double kPriorReach_mm = 50.0;
constexpr double kPriorSigmas = 1.5;  // of the coils' position, and what cubics between them miss
constexpr std::array<double, 3> kWiderFactors = {4, 2, 1};  // of epsilon, in turn
constexpr int kMaxSteps = 20;                               // of one search
constexpr double kConverged_mm = 0.01;
constexpr double kNegligibleGain = 0.01;  // of the tempered log-likelihood: 0.5 is one standard deviation
constexpr double kNothingHeld = 1e-6;  // per mm^2: keeps matrices definite where no pixel and no prior holds

/// Information of a stationary first-order process over points `spacing_mm` apart; n x n.
Eigen::MatrixXd correlated_information(int n, double spacing_mm, double sigma_mm) {
  Eigen::MatrixXd covariance(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      covariance(i, j) = sigma_mm * sigma_mm * std::exp(-std::abs(i - j) * spacing_mm / kPriorReach_mm);
    }
  }
  return solve_llt(covariance, Eigen::MatrixXd(Eigen::MatrixXd::Identity(n, n)));
}

/// The same for x and y of each point.
Eigen::MatrixXd in_both_axes(const Eigen::MatrixXd& information) {
  const Eigen::Index n = information.rows();
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(2 * n, 2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      both.block<2, 2>(2 * i, 2 * j) = information(i, j) * Eigen::Matrix2d::Identity();
    }
  }
  return both;
}

}  // namespace

PaperImageMle::PaperImageMle(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                             const CameraCalibration& camera, const KnotCurve& curve)
    : settings_(settings),
      radius_mm_(instrument.diameter_mm / 2),
      camera_(camera),
      plane_world_(camera.T_camera_world.linear().transpose().leftCols<2>()) {
  const int vertices =
      std::min(LineSearch::kMaxLines, static_cast<int>(std::ceil(curve.length_mm() / kVertexSpacing_mm)) + 1);
  weights_.resize(vertices, curve.count());
  for (int i = 0; i < vertices; ++i) {
    weights_.row(i) = curve.weights(curve.length_mm() * i / (vertices - 1)).transpose();
  }
  line_prior_ = in_both_axes(correlated_information(curve.count(), curve.knot_point_s_mm(1),
                                                    kPriorSigmas * settings.sigma_position_mm));
  mle_prior_ = settings.paper.mle_prior == PaperMlePrior::kEmError
                   ? line_prior_
                   : kNothingHeld * Eigen::MatrixXd::Identity(line_prior_.rows(), line_prior_.cols());
  spacing_mm_ = curve.length_mm() / (vertices - 1);
  path_.resize(static_cast<std::size_t>(vertices));
  J_image_plane_.resize(path_.size());
}

void PaperImageMle::look_from(const std::optional<ViewGeometry>& geometry) {
  camera_.look_from(geometry);
  plane_world_ = camera_.calibration().T_camera_world.linear().transpose().leftCols<2>();
}

void PaperImageMle::project(const Eigen::Matrix3Xd& K) {
  const Eigen::Matrix3Xd curve_mm = K * weights_.transpose();
  for (std::size_t i = 0; i < path_.size(); ++i) {
    const auto projection = camera_.project(curve_mm.col(static_cast<Eigen::Index>(i)));
    if (!projection) {
      path_[i] = {Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN()), 0};
      J_image_plane_[i].setZero();
      continue;
    }
    J_image_plane_[i] = projection->J_image_world * plane_world_;
    path_[i] = {projection->p_image_px, radius_mm_ * camera_.calibration().fx / projection->depth_mm};
  }
}

// Fills lines_ from the projected path; how many are in view.
int PaperImageMle::prepare_lines() {
  int in_view = 0;
  for (std::size_t i = 0; i < path_.size(); ++i) {
    const Eigen::Vector2d along =
        path_[std::min(i + 1, path_.size() - 1)].p_px - path_[i > 0 ? i - 1 : 0].p_px;
    CorrespondenceLine& line = lines_[i];
    line.base_px = path_[i].p_px;
    line.normal = Eigen::Vector2d(-along.y(), along.x()).normalized();
    line.in_view = camera_.contains(path_[i].p_px, kViewMargin_px) && along.norm() > kShortest_px_per_mm &&
                   !is_masked(camera_.calibration(), path_[i].p_px);
    in_view += line.in_view ? 1 : 0;
  }
  return in_view;
}

// Least squares of the lines' offsets and the prior: linear, once.
bool PaperImageMle::start_on_lines(const ImageMeasurement& image, const Eigen::Matrix3Xd& K_em, int reach_px,
                                   Eigen::Matrix3Xd& K) {
  project(K);
  const int count = static_cast<int>(path_.size());
  if (prepare_lines() < kMinVertices ||
      search_.search(image, lines_, count, reach_px, kTransition_px).inlier_ratio < kMinAgreeing) {
    return false;
  }
  Eigen::MatrixXd matrix = line_prior_;
  Eigen::VectorXd right = -line_prior_ * moved_in_plane(K, K_em);
  Eigen::VectorXd row(2 * K.cols());
  for (int i = 0; i < count; ++i) {
    const CorrespondenceLine& line = lines_[static_cast<std::size_t>(i)];
    if (!line.in_view) continue;
    const Eigen::RowVector2d across = line.normal.transpose() * J_image_plane_[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < K.cols(); ++j) row.segment<2>(2 * j) = across.transpose() * weights_(i, j);
    const double variance =
        (line.variance_px2 + settings_.sigma_image_px * settings_.sigma_image_px) * settings_.image_temper;
    matrix += row * row.transpose() / variance;
    right += row * (line.offset_px / variance);
  }
  K = displaced(K, solve_llt(matrix, right));
  return true;
}

void PaperImageMle::choose_band(const ImageMeasurement& image, const Eigen::Matrix3Xd& K) {
  project(K);
  band_.choose_band(image, path_, kBandReach_px, model_,
                    settings_.paper.hub_end == PaperHubEnd::kGoesOn ? PathEnd::kGoesOn : PathEnd::kCapped);
}

Eigen::VectorXd PaperImageMle::moved_in_plane(const Eigen::Matrix3Xd& K, const Eigen::Matrix3Xd& K_em) const {
  return (plane_world_.transpose() * (K - K_em)).reshaped();
}

Eigen::Matrix3Xd PaperImageMle::displaced(const Eigen::Matrix3Xd& K, const Eigen::VectorXd& step) const {
  return K + plane_world_ * step.reshaped(2, K.cols());
}

// J' F J of the path's block tridiagonal F and the vertices' derivatives by the knot points.
Eigen::MatrixXd PaperImageMle::knot_information(const BandDerivatives& derivatives) const {
  const auto vertices = static_cast<Eigen::Index>(path_.size());
  const Eigen::Index n = weights_.cols();
  Eigen::MatrixXd J(2 * vertices, 2 * n);
  for (Eigen::Index i = 0; i < vertices; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      J.block<2, 2>(2 * i, 2 * j) = weights_(i, j) * J_image_plane_[static_cast<std::size_t>(i)];
    }
  }
  Eigen::MatrixXd FJ(2 * vertices, 2 * n);
  for (Eigen::Index i = 0; i < vertices; ++i) {
    const auto v = static_cast<std::size_t>(i);
    FJ.middleRows<2>(2 * i) = derivatives.information[v] * J.middleRows<2>(2 * i);
    if (i + 1 < vertices)
      FJ.middleRows<2>(2 * i) += derivatives.information_next[v] * J.middleRows<2>(2 * i + 2);
    if (i > 0) {
      FJ.middleRows<2>(2 * i) += derivatives.information_next[v - 1].transpose() * J.middleRows<2>(2 * i - 2);
    }
  }
  return J.transpose() * FJ / settings_.image_temper;
}

PaperImageMle::Quadratic PaperImageMle::expand(const Eigen::Matrix3Xd& K, const Eigen::Matrix3Xd& K_em,
                                               double epsilon_px, bool with_derivatives) {
  project(K);
  const Eigen::VectorXd moved = moved_in_plane(K, K_em);
  BandDerivatives derivatives;
  Quadratic quadratic;
  quadratic.value = 0.5 * moved.dot(mle_prior_ * moved) -
                    band_.log_likelihood(path_, epsilon_px, with_derivatives ? &derivatives : nullptr) /
                        settings_.image_temper;
  if (!with_derivatives) return quadratic;
  quadratic.gradient = mle_prior_ * moved;
  for (Eigen::Index j = 0; j < K.cols(); ++j) {
    Eigen::Vector2d climbing = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < path_.size(); ++i) {
      const auto vertex = static_cast<Eigen::Index>(i);
      climbing += weights_(vertex, j) * J_image_plane_[i].transpose() * derivatives.gradient.col(vertex);
    }
    quadratic.gradient.segment<2>(2 * j) -= climbing / settings_.image_temper;
  }
  quadratic.matrix = knot_information(derivatives);
  return quadratic;
}

// Eq. (18) by Levenberg-Marquardt; the number of steps tried.
int PaperImageMle::climb(const Eigen::Matrix3Xd& K_em, double epsilon_px, Eigen::Matrix3Xd& K) {
  double damping = 1e-3;
  Quadratic here = expand(K, K_em, epsilon_px, true);
  for (int step = 1; step <= kMaxSteps; ++step) {
    Eigen::MatrixXd matrix = here.matrix + mle_prior_;
    matrix.diagonal() = matrix.diagonal() * (1 + damping);
    const Eigen::VectorXd move = solve_ldlt(matrix, -here.gradient);
    if (!move.allFinite()) return step;
    const Eigen::Matrix3Xd K_trial = displaced(K, move);
    const double gain = here.value - expand(K_trial, K_em, epsilon_px, false).value;
    if (gain > 0) {
      K = K_trial;
      if (gain < kNegligibleGain || move.cwiseAbs().maxCoeff() < kConverged_mm) return step;
      here = expand(K, K_em, epsilon_px, true);
      damping = std::max(damping / 3, 1e-6);
    } else {
      if (move.cwiseAbs().maxCoeff() < kConverged_mm) return step;
      damping *= 5;
    }
  }
  return kMaxSteps;
}

PaperMleOutcome PaperImageMle::search(const ImageMeasurement& image, const Eigen::Matrix3Xd& K_em, bool first,
                                      Eigen::Matrix3Xd& K) {
  PaperMleOutcome outcome;
  project(K);
  const int in_view = prepare_lines();
  outcome.in_view_ratio = static_cast<double>(in_view) / static_cast<double>(path_.size());
  if (in_view < kMinVertices) return outcome;
  if (first && settings_.paper.mle_start == PaperMleStart::kLines) {
    for (const int divisor : kStartDivisors) {
      const int reach =
          std::clamp(static_cast<int>(settings_.image_search_px) / divisor, 3, LineSearch::kMaxReach);
      if (!start_on_lines(image, K_em, reach, K)) break;
    }
  }
  choose_band(image, K);
  if (!model_.learned()) {
    if (!model_.learn(image, band_.pixels(), 1)) return outcome;
    band_.weigh(image, model_);
  }
  outcome.looked = true;
  for (const double factor : kWiderFactors) {
    if (factor == 1 || (first && settings_.paper.heaviside == PaperHeaviside::kNarrowing)) {
      outcome.iterations += climb(K_em, factor * settings_.paper.heaviside_px, K);
    }
  }
  prepare_lines();
  outcome.agreeing_ratio =
      search_.search(image, lines_, static_cast<int>(path_.size()), kJudgingReach_px, kTransition_px)
          .inlier_ratio;
  seen_.record({lines_.data(), path_.size()}, spacing_mm_);
  return outcome;
}

void PaperImageMle::adapt(const ImageMeasurement& image, const Eigen::Matrix3Xd& K) {
  if (settings_.paper.appearance_share > 0) {
    choose_band(image, K);
    model_.learn(image, band_.pixels(), settings_.paper.appearance_share);
  }
}

}  // namespace tubed
