#include "clients/tubectl/watch/published_agreement.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "daemon/estimator/agreement/agreement_words.hpp"
#include "idl/wire_fields.h"

namespace tubed {

namespace {

template <typename Ours, typename Wires>
void read_field(Ours& ours, const Wires& wire) {
  ours = static_cast<Ours>(wire);
}

template <typename T, std::size_t size>
void read_field(std::array<T, size>& ours, const T (&wire)[size]) {
  std::copy(std::begin(wire), std::end(wire), ours.begin());
}

}  // namespace

EmImageAgreement agreement_of(const tubed_EmImageAgreement& wire) {
  EmImageAgreement ours;
#define TUBED_READ_FIELD(field) read_field(ours.field, wire.field);
#define TUBED_READ_NO_LIST(list, count) static_assert(false);
  TUBED_FIELDS_OF_EmImageAgreement(TUBED_READ_FIELD, TUBED_READ_NO_LIST)
#undef TUBED_READ_FIELD
#undef TUBED_READ_NO_LIST
      return ours;
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
