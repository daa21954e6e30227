#include "clients/evaluation/configured_sequence.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "daemon/config/load_configuration.hpp"
#include "drivers/driver_registry/driver_registry.hpp"

namespace tubed {

namespace {

std::string size_words(const CameraCalibration& camera) {
  return std::to_string(camera.width) + " x " + std::to_string(camera.height) + " px";
}

CameraCalibration configured_camera(const CameraCalibration& recorded, const Configuration& configuration) {
  const auto& cameras = configuration.room.cameras;
  const auto found = std::find_if(cameras.begin(), cameras.end(), [&](const CameraCalibration& camera) {
    return camera.name == recorded.name;
  });
  if (found == cameras.end()) {
    throw std::runtime_error(configuration.file.string() + " has no [[camera]] named \"" + recorded.name +
                             "\", as the sequence has one; add it");
  }
  if (found->width != recorded.width || found->height != recorded.height) {
    throw std::runtime_error(configuration.file.string() + ": camera \"" + recorded.name + "\" has " +
                             size_words(*found) + ", in the sequence " + size_words(recorded));
  }
  return *found;
}

std::size_t instrument_of(const std::string& id, const Configuration& configuration) {
  const auto& instruments = configuration.room.instruments;
  const auto found =
      std::find_if(instruments.begin(), instruments.end(),
                   [&](const InstrumentDescription& instrument) { return instrument.id == id; });
  if (found == instruments.end() && instruments.size() != 1) {
    throw std::runtime_error(configuration.file.string() + " has several instruments and none is \"" + id +
                             "\", the sequence's catheter; give it that id");
  }
  return found == instruments.end() ? 0 : static_cast<std::size_t>(found - instruments.begin());
}

}  // namespace

ConfiguredSequence as_configured(Sequence sequence, const Configuration& configuration) {
  RoomDescription room = configuration.room;
  room.cameras.clear();
  for (const CameraCalibration& recorded : sequence.room.cameras) {
    room.cameras.push_back(configured_camera(recorded, configuration));
  }
  const std::size_t instrument = instrument_of(sequence.room.instruments.front().id, configuration);
  room.instruments = {configuration.room.instruments[instrument]};
  sequence.room = std::move(room);
  for (SequenceFrame& frame : sequence.frames) {
    const CameraCalibration& camera = sequence.room.cameras[static_cast<std::size_t>(frame.camera)];
    if (camera.geometry == GeometryUse::kConfiguration) {
      frame.geometry.reset();
    }
    frame.t_s -= 1e-3 * camera.time_offset_ms;
  }
  // Stable: two cameras exposed together stay in their order.
  std::stable_sort(sequence.frames.begin(), sequence.frames.end(),
                   [](const SequenceFrame& a, const SequenceFrame& b) { return a.t_s < b.t_s; });
  return {std::move(sequence), configuration.estimators[instrument], configuration.frangi,
          std::chrono::nanoseconds(static_cast<std::int64_t>(configuration.pipeline.image_stale_ms * 1e6))};
}

ConfiguredSequence as_configured(Sequence sequence, const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream) {
    throw std::runtime_error(file.string() + ": cannot be read");
  }
  return as_configured(std::move(sequence), parse_configuration(text.str(), file, drivers()));
}

}  // namespace tubed
