// factorisations_bench: the project's own Cholesky factorisations beside Eigen's and beside each other.
#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>

#include "daemon/estimator/algebra/dense_cholesky.hpp"
#include "daemon/estimator/algebra/spline_band_cholesky.hpp"
#include "drivers/laboratory/instrument/banded_cholesky.hpp"

namespace tubed {
namespace {

Eigen::MatrixXd positive_matrix(Eigen::Index n) {
  const Eigen::MatrixXd root = Eigen::MatrixXd::Random(n, n);
  return root * root.transpose() + static_cast<double>(n) * Eigen::MatrixXd::Identity(n, n);
}

void dense_own(benchmark::State& state) {
  const Eigen::MatrixXd A = positive_matrix(state.range(0));
  DenseCholesky cholesky(A.rows());
  Eigen::VectorXd x(A.rows());
  for (auto _ : state) {
    cholesky.matrix() = A;
    x.setOnes();
    if (!cholesky.factorise()) state.SkipWithError("not positive definite");
    cholesky.solve(x);
    benchmark::DoNotOptimize(x.data());
  }
}

void dense_eigen(benchmark::State& state) {
  const Eigen::MatrixXd A = positive_matrix(state.range(0));
  Eigen::LLT<Eigen::MatrixXd> cholesky(A.rows());
  Eigen::VectorXd x(A.rows());
  for (auto _ : state) {
    x.setOnes();
    cholesky.compute(A);
    cholesky.solveInPlace(x);
    benchmark::DoNotOptimize(x.data());
  }
}

void dense_own_inverse(benchmark::State& state) {
  const Eigen::MatrixXd A = positive_matrix(state.range(0));
  DenseCholesky cholesky(A.rows());
  Eigen::MatrixXd inverse(A.rows(), A.rows());
  for (auto _ : state) {
    cholesky.matrix() = A;
    if (!cholesky.factorise() || !cholesky.invert(inverse)) state.SkipWithError("not positive definite");
    benchmark::DoNotOptimize(inverse.data());
  }
}

void dense_eigen_inverse(benchmark::State& state) {
  const Eigen::MatrixXd A = positive_matrix(state.range(0));
  Eigen::LLT<Eigen::MatrixXd> cholesky(A.rows());
  Eigen::MatrixXd inverse(A.rows(), A.rows());
  for (auto _ : state) {
    cholesky.compute(A);
    inverse.setIdentity();
    cholesky.solveInPlace(inverse);
    benchmark::DoNotOptimize(inverse.data());
  }
}

constexpr int kBelow = kBandRows - 1;  // rows below the diagonal

double band_element(Eigen::Index below) { return below == 0 ? 4.0 : 0.3 / static_cast<double>(below); }

void band_of_splines(benchmark::State& state) {
  const Eigen::Index n = state.range(0);
  LowerBand band = LowerBand::Zero(kBandRows, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index m = 0; m < std::min<Eigen::Index>(kBandRows, n - j); ++m) band(m, j) = band_element(m);
  }
  SplineBandCholesky cholesky(n);
  Eigen::VectorXd x(n);
  for (auto _ : state) {
    x.setOnes();
    if (!cholesky.factorise(band, 0)) state.SkipWithError("not positive definite");
    cholesky.solve(x);
    benchmark::DoNotOptimize(x.data());
  }
}

void band_of_laboratory(benchmark::State& state) {
  const Eigen::Index n = state.range(0);
  BandedCholesky<kBelow> matrix;
  matrix.reset(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index m = 0; m < std::min<Eigen::Index>(kBandRows, n - j); ++m) {
      matrix.add(j + m, j, band_element(m));
    }
  }
  Eigen::VectorXd x(n);
  for (auto _ : state) {
    BandedCholesky<kBelow> factor = matrix;
    x.setOnes();
    if (!factor.factorise()) state.SkipWithError("not positive definite");
    factor.solve(x);
    benchmark::DoNotOptimize(x.data());
  }
}

// 26 coefficients are the default and 48 the most; with six coils and the errors of each.
BENCHMARK(dense_own)->Arg(78)->Arg(114)->Arg(180);
BENCHMARK(dense_eigen)->Arg(78)->Arg(114)->Arg(180);
BENCHMARK(dense_own_inverse)->Arg(78)->Arg(114)->Arg(180);
BENCHMARK(dense_eigen_inverse)->Arg(78)->Arg(114)->Arg(180);
BENCHMARK(band_of_splines)->Arg(78)->Arg(144)->Arg(600);
BENCHMARK(band_of_laboratory)->Arg(78)->Arg(144)->Arg(600);

}  // namespace
}  // namespace tubed

BENCHMARK_MAIN();
