#include "clients/tubectl/run/replay_configuration.hpp"

#include <toml++/toml.h>

#include <sstream>

#include "drivers/replay/room_tables.hpp"

namespace tubed {

namespace {

toml::table table_of(const InstrumentDescription& instrument, const std::string& id, EstimatorMode mode) {
  toml::array coils;
  for (const CoilPlacement& coil : instrument.coils) {
    coils.push_back(toml::table{{"sensor", coil.sensor}, {"offset_from_tip_mm", coil.offset_from_tip_mm}});
  }
  return toml::table{{"id", id},
                     {"diameter_mm", instrument.diameter_mm},
                     {"length_mm", instrument.length_mm},
                     {"mode", std::string(name_of(mode))},
                     {"coil", std::move(coils)}};
}

toml::array instruments_of(const Sequence& sequence, const ReplayConfigurationSettings& settings) {
  const InstrumentDescription& instrument = sequence.room.instruments.front();
  toml::array instruments;
  instruments.push_back(table_of(instrument, instrument.id, settings.mode));
  if (settings.instruments == TrackedTwice::kEmAloneToo) {
    instruments.push_back(table_of(instrument, instrument.id + "-em", EstimatorMode::kEm));
  }
  return instruments;
}

}  // namespace

std::string replay_configuration(const Sequence& sequence, const ReplayConfigurationSettings& settings) {
  toml::table em{{"driver", "replay"}};
  if (sequence.room.registered) em.insert("T_world_em", rows_of(sequence.room.T_world_em));
  toml::array cameras;
  for (const CameraCalibration& camera : sequence.room.cameras) {
    toml::table table = table_of(camera);
    table.insert("driver", "replay");
    cameras.push_back(std::move(table));
  }
  const std::string folder =
      std::filesystem::weakly_canonical(std::filesystem::absolute(sequence.folder)).string();
  const toml::table file{
      {"daemon", toml::table{{"log_level", "info"}}},
      {"dds", toml::table{{"domain", settings.dds_domain}}},
      {"em", std::move(em)},
      {"camera", std::move(cameras)},
      {"instrument", instruments_of(sequence, settings)},
      {"replay", toml::table{{"folder", folder}, {"loop", settings.replay == ReplayLength::kForEver}}}};
  std::ostringstream text;
  text << "# Replays the sequence folder " << folder << ": written by tubectl configure.\n" << file << '\n';
  return text.str();
}

}  // namespace tubed
