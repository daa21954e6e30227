#include "daemon/estimator/algebra/normal_equations.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <vector>

namespace tubed {
namespace {

constexpr int kCoefficients = 9;

/// The same residuals in NormalEquations and as rows of a plain Jacobian.
class Residuals {
 public:
  explicit Residuals(int further_columns)
      : equations(kCoefficients, further_columns), columns_(kCoefficients + further_columns) {
    std::srand(3);
    for (int first = 0; first + 3 < kCoefficients; ++first) {
      for (int again = 0; again < 3; ++again) {
        const std::array<double, 4> weights = random_weights();
        const Eigen::Vector3d gradient = Eigen::Vector3d::Random();
        const double residual = Eigen::Vector2d::Random()[0];
        equations.add(first, weights, gradient, residual);
        add_row(first, weights, gradient, residual);
      }
      const std::array<double, 4> weights = random_weights();
      const Eigen::Vector3d residual = Eigen::Vector3d::Random();
      equations.add_isotropic(first, weights, 1.7, residual);
      for (int axis = 0; axis < 3; ++axis) {
        add_row(first, weights, 1.7 * Eigen::Vector3d::Unit(axis), residual[axis]);
      }
      for (int k = 0; k < further_columns; ++k) {
        add_with(first, kCoefficients + k);
      }
    }
  }

  [[nodiscard]] Eigen::MatrixXd J() const {
    Eigen::MatrixXd all(rows_.size(), 3 * columns_);
    for (std::size_t i = 0; i < rows_.size(); ++i) all.row(static_cast<Eigen::Index>(i)) = rows_[i];
    return all;
  }
  [[nodiscard]] Eigen::VectorXd r() const {
    return Eigen::Map<const Eigen::VectorXd>(r_.data(), static_cast<Eigen::Index>(r_.size()));
  }

  NormalEquations equations;

 private:
  static std::array<double, 4> random_weights() {
    const Eigen::Vector4d random = Eigen::Vector4d::Random();
    return {random[0], random[1], random[2], random[3]};
  }

  void add_row(int first, const std::array<double, 4>& weights, const Eigen::Vector3d& gradient,
               double residual) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(3 * columns_);
    for (int k = 0; k < 4; ++k) {
      row.segment<3>(3 * (first + k)) = weights[static_cast<std::size_t>(k)] * gradient.transpose();
    }
    rows_.push_back(row);
    r_.push_back(residual);
  }

  void add_with(int first, int further) {
    const std::array<double, 4> weights = random_weights();
    const Eigen::Matrix3d gradient = Eigen::Matrix3d::Random();
    const Eigen::Vector3d residual = Eigen::Vector3d::Random();
    equations.add_with(first, weights, gradient, further, 0.6, residual);
    for (int axis = 0; axis < 3; ++axis) {
      add_row(first, weights, gradient.row(axis).transpose(), residual[axis]);
      rows_.back()[3 * further + axis] = 0.6;
    }
  }

  int columns_;
  std::vector<Eigen::RowVectorXd> rows_;
  std::vector<double> r_;
};

Eigen::VectorXd expected_step(const Eigen::MatrixXd& JtJ, const Eigen::VectorXd& gradient, double damping) {
  Eigen::MatrixXd damped = JtJ;
  damped.diagonal() *= 1 + damping;
  return damped.ldlt().solve(-gradient);
}

TEST(NormalEquations, OfCoefficientsAloneAreThoseOfTheJacobian) {
  Residuals residuals(0);
  const Eigen::MatrixXd J = residuals.J();
  Eigen::Matrix3Xd step;
  ASSERT_TRUE(residuals.equations.solve(0.1, step));
  const Eigen::VectorXd expected = expected_step(J.transpose() * J, J.transpose() * residuals.r(), 0.1);
  EXPECT_LT((step.reshaped() - expected).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(residuals.equations.cost(), residuals.r().squaredNorm(), 1e-9);
}

TEST(NormalEquations, WithFurtherColumnsAndAPriorAreThoseOfTheJacobian) {
  Residuals residuals(2);
  const Eigen::Index n = 3 * (kCoefficients + 2);
  const Eigen::MatrixXd A = Eigen::MatrixXd::Random(n, n);
  const Eigen::MatrixXd information = A.transpose() * A;
  const Eigen::VectorXd departure = Eigen::VectorXd::Random(n);
  residuals.equations.add_prior(information, departure);
  const Eigen::MatrixXd J = residuals.J();
  const Eigen::MatrixXd JtJ = J.transpose() * J + information;
  const Eigen::VectorXd gradient = J.transpose() * residuals.r() + information * departure;
  Eigen::Matrix3Xd step;
  ASSERT_TRUE(residuals.equations.solve(0, step));
  EXPECT_LT((step.reshaped() - expected_step(JtJ, gradient, 0)).cwiseAbs().maxCoeff(), 1e-9);
  ASSERT_TRUE(residuals.equations.invert_and_solve(step));
  EXPECT_LT((step.reshaped() - expected_step(JtJ, gradient, 0)).cwiseAbs().maxCoeff(), 1e-9);
  const Eigen::MatrixXd inverse = JtJ.ldlt().solve(Eigen::MatrixXd::Identity(n, n));
  EXPECT_LT((residuals.equations.inverse() - inverse).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(residuals.equations.cost(),
              residuals.r().squaredNorm() + departure.dot(information * departure), 1e-9);
}

// Against residuals whose covariance is I + H H^T, written out.
TEST(NormalEquations, ASharedErrorIsCorrelatedNoise) {
  std::srand(5);
  constexpr int kPieces = kCoefficients - 3;
  constexpr int kEach = 9;
  NormalEquations equations(kCoefficients, 0);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(2 * kPieces * kEach, 3 * kCoefficients);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(J.rows(), 2 * SharedError::kParts);
  const Eigen::VectorXd r = Eigen::VectorXd::Random(J.rows());
  Eigen::Index row = 0;
  for (int error = 0; error < 2; ++error) {
    equations.begin_shared();
    for (int first = 0; first < kPieces; ++first) {
      for (int again = 0; again < kEach; ++again, ++row) {
        const Eigen::Vector4d w = Eigen::Vector4d::Random();
        const Eigen::Vector3d gradient = Eigen::Vector3d::Random();
        const SharedError::Parts h = 3 * SharedError::Parts::Random();
        const std::array<double, 4> weights{w[0], w[1], w[2], w[3]};
        equations.add(first, weights, gradient, r[row]);
        equations.add_shared(first, weights, gradient, r[row], h);
        for (int k = 0; k < 4; ++k) J.block<1, 3>(row, 3 * (first + k)) = w[k] * gradient.transpose();
        H.block<1, SharedError::kParts>(row, error * SharedError::kParts) = h.transpose();
      }
    }
    equations.end_shared();
  }
  const Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(J.rows(), J.rows()) + H * H.transpose();
  const Eigen::MatrixXd information = covariance.inverse();
  Eigen::Matrix3Xd step;
  ASSERT_TRUE(equations.solve(0.1, step));
  const Eigen::MatrixXd JtJ = J.transpose() * information * J;
  const Eigen::VectorXd expected = expected_step(JtJ, J.transpose() * information * r, 0.1);
  EXPECT_LT((step.reshaped() - expected).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_NEAR(equations.cost(), r.dot(information * r), 1e-8);
  ASSERT_TRUE(equations.invert());
  EXPECT_LT((equations.inverse() * JtJ - Eigen::MatrixXd::Identity(JtJ.rows(), JtJ.cols())).norm(), 1e-6);
}

TEST(NormalEquations, ACoefficientThatNoResidualHoldsIsRefused) {
  NormalEquations equations(6, 0);
  equations.add_isotropic(0, {1, 1, 1, 1}, 1, Eigen::Vector3d::Zero());
  Eigen::Matrix3Xd step;
  EXPECT_FALSE(equations.solve(0, step));
  EXPECT_FALSE(equations.invert());
}

// The same, of blocks, with the bilinear residuals of a hook's plane in mind: the unknown u is written out as
// further columns with its prior.
TEST(NormalEquations, BlocksThatShareAnErrorAreThoseOfTheJacobianWithItWrittenOut) {
  std::srand(6);
  constexpr int kPieces = kCoefficients - 3;
  constexpr int kColumns = 3 * kCoefficients;
  NormalEquations equations(kCoefficients, 0);
  const Eigen::Index rows = 3 * 2 * kPieces + 1 + SharedError::kParts;
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, kColumns + SharedError::kParts);
  Eigen::VectorXd r = Eigen::VectorXd::Zero(rows);
  Eigen::Index row = 0;
  for (const bool is_shared : {false, true}) {
    if (is_shared) equations.begin_shared();
    for (int first = 0; first < kPieces; ++first, row += 3) {
      const NormalEquations::FourColumns block = NormalEquations::FourColumns::Random();
      const Eigen::Matrix<double, 3, SharedError::kParts> H =
          Eigen::Matrix<double, 3, SharedError::kParts>::Random();
      const Eigen::Vector3d residual = Eigen::Vector3d::Random();
      J.block<3, 12>(row, 3 * first) = block;
      r.segment<3>(row) = residual;
      if (is_shared) {
        J.block<3, SharedError::kParts>(row, kColumns) = H;
        equations.add_shared_block(first, block, residual, H);
      } else {
        equations.add_block(first, block, residual);
      }
    }
  }
  const SharedError::Parts alone = SharedError::Parts::Random();
  J.block<1, SharedError::kParts>(row, kColumns) = alone.transpose();
  r[row] = 0.7;
  equations.add_to_shared(0.7, alone);
  equations.end_shared();
  J.bottomRightCorner<SharedError::kParts, SharedError::kParts>().setIdentity();  // u ~ N(0, I)

  const Eigen::VectorXd expected = (J.transpose() * J).ldlt().solve(-J.transpose() * r);
  Eigen::Matrix3Xd step;
  ASSERT_TRUE(equations.solve(0, step));
  EXPECT_LT((step.reshaped() - expected.head(kColumns)).cwiseAbs().maxCoeff(), 1e-8);
  const Eigen::MatrixXd inverse =
      (J.transpose() * J)
          .ldlt()
          .solve(Eigen::MatrixXd::Identity(kColumns + SharedError::kParts, kColumns + SharedError::kParts));
  ASSERT_TRUE(equations.invert());
  EXPECT_LT((equations.inverse() - inverse.topLeftCorner(kColumns, kColumns)).cwiseAbs().maxCoeff(), 1e-8);
  // With C at zero step and u at its best: what is left of the squares.
  const Eigen::MatrixXd H = J.rightCols(SharedError::kParts);
  const Eigen::VectorXd u = (H.transpose() * H).ldlt().solve(-H.transpose() * r);
  EXPECT_NEAR(equations.cost(), (r + H * u).squaredNorm(), 1e-9);
}

}  // namespace
}  // namespace tubed
