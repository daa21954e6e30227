#include "clients/tubectl/watch/em_measurement.hpp"

#include <algorithm>

namespace tubed {

SequenceMeasurement measurement_of(const tubed_EmSamples& samples, const InstrumentDescription& instrument,
                                   double t_s) {
  SequenceMeasurement measurement;
  measurement.t_s = t_s;
  measurement.em_frame = samples.tracker_frame;
  const std::size_t count = std::min({static_cast<std::size_t>(samples.coil_count), instrument.coils.size(),
                                      static_cast<std::size_t>(kMaxTrackerCoils)});
  for (std::size_t k = 0; k < count; ++k) {
    const tubed_EmCoil& coil = samples.coils[k];
    const int sensor = instrument.coils[k].sensor;
    CoilSample& sample = measurement.coils.at(static_cast<std::size_t>(sensor - 1));
    sample.status = coil.status <= 3 ? static_cast<CoilStatus>(coil.status) : CoilStatus::kMissing;
    sample.p_em_mm = Eigen::Map<const Eigen::Vector3d>(coil.p_em_mm);
    sample.tangent_em =
        (instrument.coils[k].flipped ? -1 : 1) * Eigen::Map<const Eigen::Vector3d>(coil.tangent_em);
    sample.indicator = static_cast<double>(coil.indicator);
    measurement.coil_count = std::max(measurement.coil_count, sensor);
  }
  return measurement;
}

}  // namespace tubed
