// Coils in a straight groove whose every number is known.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "clients/calibration/coil_recording.hpp"
#include "tests/daemon/estimator/simulated_tube.hpp"

namespace tubed {

/// What is drawn, standard deviations an axis.
struct CoilErrors {
  double noise_mm = 0;    ///< anew with each measurement
  double lasting_mm = 0;  ///< once a coil
  double tangent_noise = 0;
};

class Draw {
 public:
  explicit Draw(unsigned seed) : random_(seed) {}
  double normal(double sigma) { return sigma * normal_(random_); }
  Eigen::Vector3d normal3(double sigma) { return {normal(sigma), normal(sigma), normal(sigma)}; }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

inline CoilSample sample_at(const Eigen::Vector3d& p_mm, const Eigen::Vector3d& toward_tip) {
  CoilSample sample;
  sample.status = CoilStatus::kOk;
  sample.p_em_mm = p_mm;
  sample.tangent_em = toward_tip;
  return sample;
}

/// A catheter in a straight groove along (1, 2, 2) / 3 from the tip at (10, -20, -150), coils where `offsets`
/// say, stated as in Sec. 3.1; `count` measurements at 40 Hz.
inline CoilRecording straight_recording(const std::vector<double>& offsets_mm, const CoilErrors& errors,
                                        unsigned seed, int count = 80) {
  const Eigen::Vector3d tip_mm(10, -20, -150);
  const Eigen::Vector3d away = Eigen::Vector3d(1, 2, 2) / 3;
  Draw draw(seed);
  CoilRecording recording{"groove", one_view_room().instruments.front(), {}};
  std::vector<Eigen::Vector3d> lasting;
  for (std::size_t k = 0; k < offsets_mm.size(); ++k) {
    lasting.push_back(draw.normal3(errors.lasting_mm));
  }
  for (int i = 0; i < count; ++i) {
    SequenceMeasurement measurement;
    measurement.t_s = 0.025 * i;
    measurement.coil_count = static_cast<int>(offsets_mm.size());
    for (std::size_t k = 0; k < offsets_mm.size(); ++k) {
      measurement.coils[k] =
          sample_at(tip_mm + offsets_mm[k] * away + lasting[k] + draw.normal3(errors.noise_mm),
                    (-away + draw.normal3(errors.tangent_noise)).normalized());
    }
    recording.measurements.push_back(measurement);
  }
  return recording;
}

/// How often of so many draws an error was within so many of its own standard deviations.
struct Coverage {
  int of = 0;
  std::array<int, 3> within{};
  void add(double error, double sigma) {
    ++of;
    for (std::size_t n = 0; n < within.size(); ++n) {
      within[n] += std::abs(error) <= static_cast<double>(n + 1) * sigma ? 1 : 0;
    }
  }
  [[nodiscard]] double share(int sigmas) const {
    return static_cast<double>(within.at(static_cast<std::size_t>(sigmas - 1))) / of;
  }
};

}  // namespace tubed
