#include "clients/evaluation/simulated_reference.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <vector>

#include "drivers/replay/room_tables.hpp"

namespace tubed {

namespace {

constexpr std::int64_t kRegistrationMeasurements = 200;

CoilSample mean_at_rest(const SimulatedTracker& tracker, const SimulatedWorld& world, std::size_t index) {
  CoilSample mean;
  mean.p_em_mm.setZero();
  mean.tangent_em.setZero();
  mean.x_axis_em.setZero();
  double count = 0;
  for (std::int64_t k = 1; k <= kRegistrationMeasurements; ++k) {
    const CoilSample sample = tracker.measure_reference(world, index, -k, 0);
    if (sample.status == CoilStatus::kOk) {
      count += 1;
      mean.p_em_mm += (sample.p_em_mm - mean.p_em_mm) / count;
      mean.tangent_em += sample.tangent_em;
      mean.x_axis_em += sample.x_axis_em;
    }
  }
  mean.tangent_em.normalize();
  return mean;
}

toml::array list_of(const std::array<Eigen::Vector3d, 2>& vectors) {
  toml::array numbers;
  for (const Eigen::Vector3d& vector : vectors) {
    for (const double number : vector) {
      numbers.push_back(number);
    }
  }
  return numbers;
}

}  // namespace

DriverSettings SimulatedReference::in(const DriverSettings& settings) const {
  return settings.with("generator_shift_mm", shift_mm)
      .with("generator_turn_deg", turn_deg)
      .with("generator_moves_at_s", at_s)
      .with("generator_drift_mm_s", drift_mm_s);
}

void add_reference(const SimulatedReference& reference, RoomDescription& room) {
  if (reference.kind == "none") {
    return;
  }
  int last = 0;
  for (const CoilPlacement& coil : tracked_coils(room)) {
    last = std::max(last, coil.sensor);
  }
  room.reference = ReferenceDescription{};
  room.reference->sensors = {last + 1};
  if (reference.kind == "coils") {
    room.reference->sensors.push_back(last + 2);
  }
}

ReferenceDescription registered_reference(const SimulatedTracker& tracker, const SimulatedWorld& world) {
  ReferenceDescription reference = *world.room().reference;
  for (std::size_t i = 0; i < reference.sensors.size(); ++i) {
    const CoilSample mean = mean_at_rest(tracker, world, i);
    if (reference.has_two_coils()) {
      reference.p_em_registered_mm.at(i) = mean.p_em_mm;
      reference.axis_em_registered.at(i) = mean.tangent_em;
    } else {
      const Eigen::Vector3d y = mean.tangent_em.cross(mean.x_axis_em).normalized();
      reference.T_em_reference_registered.linear() << y.cross(mean.tangent_em), y, mean.tangent_em;
      reference.T_em_reference_registered.translation() = mean.p_em_mm;
    }
  }
  return reference;
}

void write_reference(const ReferenceDescription& reference, const std::filesystem::path& file) {
  toml::table table;
  if (reference.has_two_coils()) {
    table.insert("sensors", toml::array{reference.sensors[0], reference.sensors[1]});
    table.insert("positions_em_mm", list_of(reference.p_em_registered_mm));
    table.insert("axes_em", list_of(reference.axis_em_registered));
  } else {
    table.insert("sensor", reference.sensors.front());
    table.insert("T_em_reference", rows_of(reference.T_em_reference_registered));
  }
  std::ofstream stream(file);
  stream << toml::table{{"em", toml::table{{"reference", table}}}} << '\n';
  if (!stream.flush()) {
    throw std::runtime_error(file.string() + " cannot be written; is the disk full?");
  }
}

}  // namespace tubed
