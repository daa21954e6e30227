#include "clients/tubectl/run/replay_configuration.hpp"

#include <toml++/toml.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "drivers/interface/toml_nesting.hpp"
#include "drivers/replay/room_tables.hpp"

namespace tubed {

namespace {

toml::table table_of(const InstrumentDescription& instrument, const std::string& id, EstimatorMode mode) {
  toml::array coils;
  for (const CoilPlacement& coil : instrument.coils) {
    coils.push_back(toml::table{{"sensor", coil.sensor}, {"offset_from_tip_mm", coil.offset_from_tip_mm}});
  }
  toml::table table{{"id", id},
                    {"diameter_mm", instrument.diameter_mm},
                    {"length_mm", instrument.length_mm},
                    {"mode", std::string(name_of(mode))},
                    {"coil", std::move(coils)}};
  if (!instrument.marks_mm.empty()) {
    toml::array marks_mm;
    for (const double mark_mm : instrument.marks_mm) marks_mm.push_back(mark_mm);
    table.insert("marks_mm", std::move(marks_mm));
    table.insert("mark_length_mm", instrument.mark_length_mm);
  }
  return table;
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

/// [em.reference] of the folder's reference.toml, as `tubectl simulate --reference` writes it.
std::optional<toml::table> reference_of(const Sequence& sequence) {
  const std::filesystem::path file = sequence.folder / "reference.toml";
  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    return std::nullopt;
  }
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  try {
    if (line_of_too_many_dots(text)) throw std::runtime_error("tables lie too deep in each other");
    const toml::table parsed = toml::parse(text);
    const toml::table* const found = parsed["em"]["reference"].as_table();
    if (found == nullptr) throw std::runtime_error("expected the table [em.reference]");
    return *found;
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
}

}  // namespace

std::string replay_configuration(const Sequence& sequence, const ReplayConfigurationSettings& settings) {
  toml::table em{{"driver", "replay"}};
  if (sequence.room.registered) em.insert("T_world_em", rows_of(sequence.room.T_world_em));
  if (const auto reference = reference_of(sequence)) {
    em.insert("reference", *reference);
  }
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
