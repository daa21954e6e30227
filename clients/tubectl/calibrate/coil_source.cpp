#include "clients/tubectl/calibrate/coil_source.hpp"

#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <optional>

#include "clients/cpp/topic_reader.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "clients/tubectl/watch/em_measurement.hpp"
#include "daemon/config/load_configuration.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr milliseconds kIdentityTimeout{3000};

InstrumentDescription instrument_of(const tubed_TubeIdentity& identity) {
  InstrumentDescription instrument;
  instrument.id = identity.instrument_id;
  instrument.diameter_mm = static_cast<double>(identity.diameter_mm);
  instrument.length_mm = static_cast<double>(identity.length_mm);
  for (std::uint32_t k = 0; k < std::min<std::uint32_t>(identity.coil_count, kMaxTrackerCoils); ++k) {
    instrument.coils.push_back(
        {static_cast<int>(k) + 1, static_cast<double>(identity.coil_offsets_from_tip_mm[k]), false});
  }
  return instrument;
}

std::optional<InstrumentDescription> configured_instrument(const std::string& config, const std::string& id) {
  if (config.empty()) {
    return std::nullopt;
  }
  const Configuration configuration = load_configuration(config);
  const auto& instruments = configuration.room.instruments;
  if (id.empty()) {
    if (instruments.size() != 1) {
      throw CalibrationError(config + " has several instruments; say which with --instrument");
    }
    return instruments.front();
  }
  const auto found = std::find_if(instruments.begin(), instruments.end(),
                                  [&id](const auto& instrument) { return instrument.id == id; });
  if (found == instruments.end()) {
    throw CalibrationError(config + " has no [[instrument]] with id \"" + id + "\"");
  }
  return *found;
}

InstrumentDescription identity_of(const CoilSourceOptions& options) {
  const auto reader = std::make_unique<TopicReader<tubed_TubeIdentity>>(options.subscription);
  const tubed_TubeIdentity* const identity = reader->wait_for(kIdentityTimeout);
  if (identity == nullptr) {
    throw CalibrationError(
        "no daemon says what it tracks: is tubed running in this domain and partition? Name "
        "recordings to calibrate from files");
  }
  return instrument_of(*identity);
}

CoilRecording listen(const CoilSourceOptions& options, const std::string& config) {
  CoilRecording recording;
  recording.from = "the daemon in domain " + std::to_string(options.subscription.domain);
  const auto configured = configured_instrument(config, options.subscription.instrument_id);
  recording.instrument = configured ? *configured : identity_of(options);
  Subscription subscription = options.subscription;
  subscription.instrument_id = recording.instrument.id;
  const auto reader = std::make_unique<TopicReader<tubed_EmSamples>>(subscription);
  std::cerr << "listening to coils of " << recording.instrument.id << " for " << options.seconds << " s\n";
  const auto until = steady_clock::now() + std::chrono::duration_cast<steady_clock::duration>(
                                               std::chrono::duration<double>(options.seconds));
  std::optional<std::int64_t> begin_ns;
  std::int64_t newest_ns = 0;
  while (steady_clock::now() < until) {
    const tubed_EmSamples* const samples = reader->wait_for(milliseconds{100});
    if (samples == nullptr || (begin_ns && samples->measured_monotonic_ns < newest_ns)) {
      continue;
    }
    newest_ns = samples->measured_monotonic_ns;
    begin_ns = begin_ns.value_or(newest_ns);
    recording.measurements.push_back(
        measurement_of(*samples, recording.instrument, 1e-9 * static_cast<double>(newest_ns - *begin_ns)));
  }
  if (recording.measurements.empty()) {
    throw CalibrationError(recording.from + " published no coils of " + recording.instrument.id +
                           "; `tubectl status` says why");
  }
  return recording;
}

}  // namespace

void add_coil_source_options(CommandLine verb, CoilSourceOptions& options) {
  verb.add_option("RECORDING", options.recordings,
                  "Sequence folders, format 1; without one a running daemon is listened to");
  verb.add_option("--seconds", options.seconds, "How long to listen to a daemon")
      .in_range(1.0, 3600.0)
      .capture_default_str();
  add_dds_options(verb, options.subscription);
}

ConfiguredSequence read_recording(const std::string& folder, const std::string& config) {
  ConfiguredSequence run{read_sequence(folder), {}, {}, kUsualMaxImageTimeout};
  if (!config.empty()) {
    run = as_configured(std::move(run.sequence), std::filesystem::path(config));
  }
  if (run.sequence.room.reference) {
    throw CalibrationError(
        config +
        " has [em.reference]: coils are calibrated in the tracker's frame as it rests; take "
        "that table out for the calibration, and do not move the field generator");
  }
  return run;
}

std::vector<CoilRecording> read_coils(const CoilSourceOptions& options, const std::string& config) {
  if (options.recordings.empty()) {
    return {listen(options, config)};
  }
  std::vector<CoilRecording> recordings;
  for (const std::string& folder : options.recordings) {
    recordings.push_back(coils_of(read_recording(folder, config).sequence));
  }
  return recordings;
}

}  // namespace tubed
