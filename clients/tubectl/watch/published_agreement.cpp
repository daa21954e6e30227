#include "clients/tubectl/watch/published_agreement.hpp"

#include <algorithm>
#include <iterator>

#include "daemon/estimator/agreement_words.hpp"

namespace tubed {

EmImageAgreement agreement_of(const tubed_EmImageAgreement& wire) {
  EmImageAgreement agreement{.disagree = wire.disagree,
                             .explanation = static_cast<Discord>(wire.explanation),
                             .index = wire.index,
                             .probability = wire.probability,
                             .as_stated = wire.as_stated,
                             .unsure_mm = wire.unsure_mm,
                             .unsure_rad = wire.unsure_rad,
                             .arc_length_mm = wire.arc_length_mm,
                             .end_mm = wire.end_mm,
                             .clock_s = wire.clock_s,
                             .magnification = wire.magnification};
  std::copy(std::begin(wire.shift_mm), std::end(wire.shift_mm), agreement.shift_mm.begin());
  std::copy(std::begin(wire.turn_rad), std::end(wire.turn_rad), agreement.turn_rad.begin());
  std::copy(std::begin(wire.coil_mm), std::end(wire.coil_mm), agreement.coil_mm.begin());
  return agreement;
}

InstrumentDescription instrument_of(const tubed_TubeIdentity* identity) {
  InstrumentDescription instrument;
  if (identity == nullptr) {
    return instrument;
  }
  instrument.id = identity->instrument_id;
  instrument.diameter_mm = static_cast<double>(identity->diameter_mm);
  instrument.length_mm = static_cast<double>(identity->length_mm);
  const std::size_t count =
      std::min<std::size_t>(identity->coil_count, std::size(identity->coil_offsets_from_tip_mm));
  for (std::size_t i = 0; i < count; ++i) {
    CoilPlacement coil;
    coil.sensor = static_cast<int>(i) + 1;
    coil.offset_from_tip_mm = static_cast<double>(identity->coil_offsets_from_tip_mm[i]);
    instrument.coils.push_back(coil);
  }
  return instrument;
}

std::vector<CameraCalibration> cameras_of(const tubed_TubeIdentity* identity) {
  std::vector<CameraCalibration> cameras;
  const std::size_t count =
      identity == nullptr ? 0 : std::min<std::size_t>(identity->camera_count, std::size(identity->cameras));
  for (std::size_t i = 0; i < count; ++i) {
    CameraCalibration camera;
    camera.name = identity->cameras[i].name;
    cameras.push_back(camera);
  }
  return cameras;
}

std::string agreement_line(const tubed_EmImageAgreement& wire, const tubed_TubeIdentity* identity) {
  return describe_agreement(agreement_of(wire), InstrumentDescription{}, cameras_of(identity));
}

}  // namespace tubed
