// The good measurements of one coil, in the order of time.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "clients/calibration/coil_recording.hpp"

namespace tubed {

/// One element each a measurement.
struct CoilSeries {
  std::vector<double> t_s;
  std::vector<Eigen::Vector3d> p_mm;
  std::vector<Eigen::Vector3d> tangent;

  CoilSeries(const CoilRecording& recording, const CoilPlacement& coil) {
    for (const SequenceMeasurement& measurement : recording.measurements) {
      if (const CoilSample* const sample = sample_of(measurement, coil)) {
        t_s.push_back(measurement.t_s);
        p_mm.push_back(sample->p_em_mm);
        tangent.push_back(sample->tangent_em);
      }
    }
  }
};

}  // namespace tubed
