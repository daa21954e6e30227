// tubectl record: what a running daemon's tracker and fluoroscopes give, as a sequence folder.
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/topic_reader.hpp"
#include "clients/tubectl/run/run_recorder.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/tubectl/watch/dds_options.hpp"
#include "clients/tubectl/watch/em_measurement.hpp"
#include "daemon/config/load_configuration.hpp"
#include "drivers/driver_registry/driver_registry.hpp"
#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kWait{100};
constexpr std::chrono::seconds kReopen{1};
constexpr const char* kSharedImages = "image_shm";
constexpr std::size_t kMuch_bytes = std::size_t{64} << 20U;

struct RecordOptions {
  std::string folder;
  std::string config = "/etc/tubed/tubed.toml";
  double seconds = 0;  ///< 0: until it is asked to end
  bool without_images = false;
  Subscription subscription;
};

volatile std::sig_atomic_t g_asked_to_end = 0;

std::string now_in_words() {
  std::array<char, 32> text{};
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M", &local);
  return text.data();
}

InstrumentDescription instrument_of(const RecordOptions& options, const Configuration& configuration) {
  const auto& instruments = configuration.room.instruments;
  const std::string& id = options.subscription.instrument_id;
  if (id.empty() && instruments.size() == 1) return instruments.front();
  std::string known;
  for (const InstrumentDescription& instrument : instruments) {
    if (instrument.id == id) return instrument;
    known += (known.empty() ? "" : ", ") + instrument.id;
  }
  throw std::runtime_error(options.config +
                           (id.empty() ? " has several instruments" : " has no instrument '" + id + "'") +
                           "; say which with --instrument: " + known);
}

/// A folder names its coils 1, 2, 3, ... from the tip; what was measured keeps the sensors' own numbers.
bool is_numbered_from_tip(const InstrumentDescription& instrument) {
  for (std::size_t k = 0; k < instrument.coils.size(); ++k) {
    if (instrument.coils[k].sensor != static_cast<int>(k) + 1 || instrument.coils[k].flipped) return false;
  }
  return true;
}

InstrumentDescription numbered_from_tip(InstrumentDescription instrument) {
  for (std::size_t k = 0; k < instrument.coils.size(); ++k) {
    instrument.coils[k].sensor = static_cast<int>(k) + 1;
    instrument.coils[k].flipped = false;
  }
  return instrument;
}

void refuse_unshared(const Configuration& configuration, const RecordOptions& options) {
  for (std::size_t c = 0; c < configuration.image_sources.size(); ++c) {
    const std::string& driver = configuration.image_sources[c].driver;
    if (driver == kSharedImages) continue;
    throw std::runtime_error(options.config + ": camera " + configuration.room.cameras[c].name +
                             " has the driver " + driver +
                             ", whose images one program reads, the daemon: record the coils alone with "
                             "--without-images, or give the camera the driver image_shm and let `tubectl "
                             "grab` read the device");
  }
}

/// What whoever reads the folder has to know.
std::vector<std::string> remarks_on(const Configuration& configuration,
                                    const InstrumentDescription& instrument, bool without_images) {
  std::vector<std::string> remarks;
  if (!is_numbered_from_tip(instrument)) {
    remarks.emplace_back("coils have the sensors' numbers of the configuration: read it with --config");
  }
  const auto& cameras = configuration.room.cameras;
  if (!without_images && std::ranges::any_of(cameras, [](const auto& camera) { return camera.mirrored; })) {
    remarks.emplace_back("images are as they came, mirrored: read it with --config");
  }
  if (configuration.room.reference) {
    remarks.emplace_back(
        "the patient's reference is taken out of the coils already: read it with a configuration that has no "
        "[em.reference]");
  }
  return remarks;
}

/// Before all else, where the tracker is none.
std::string origin_in_words(const Configuration& configuration) {
  const DriverDescription* const tracker = find_driver(drivers(), configuration.em_source.driver);
  if (tracker == nullptr || tracker->origin == Origin::kDevice) return "";
  return tracker->origin == Origin::kSimulated ? "SIMULATED. " : "REPLAYED. ";
}

std::string note_of(const RecordOptions& options, const Configuration& configuration,
                    const std::vector<std::string>& remarks) {
  std::string note = origin_in_words(configuration) + "recorded by tubectl record on " + now_in_words() +
                     ", room as " + options.config + " has it";
  for (const std::string& remark : remarks) note += "; " + remark;
  return note;
}

/// One camera's images, taken by a thread of its own; missed() from any other.
class RecordedCamera {
 public:
  RecordedCamera(const Configuration& configuration, int camera, RunRecorder& recorder)
      : name_(configuration.room.cameras[static_cast<std::size_t>(camera)].name),
        camera_(camera),
        source_(make_image_source(configuration, camera)),
        recorder_(recorder) {
    const CameraCalibration& calibration = configuration.room.cameras[static_cast<std::size_t>(camera)];
    frame_.reserve(calibration.width, calibration.height);
    size_ = {calibration.width, calibration.height};
    thread_ = std::thread([this] { run(); });
  }
  ~RecordedCamera() {
    is_over_ = true;
    thread_.join();
  }
  RecordedCamera(const RecordedCamera&) = delete;
  RecordedCamera& operator=(const RecordedCamera&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  /// Images that were there and are not in the recording: not seen in time, refused, or of another size.
  [[nodiscard]] std::uint64_t missed() const { return missed_; }

 private:
  void run() {
    while (!is_over_) {
      const OpenResult opened = source_->open();
      if (!opened.ok) {
        say(opened.why);
        for (int i = 0; i < 10 && !is_over_; ++i) std::this_thread::sleep_for(kReopen / 10);
        continue;
      }
      said_.clear();
      while (!is_over_ && take()) source_->wait(monotonic_now() + kWait);
      source_->close();
    }
  }

  /// False: the source has to be opened again.
  bool take() {
    while (!is_over_) {
      const ReadOutcome outcome = source_->read(frame_);
      if (outcome == ReadOutcome::kLost) return false;
      if (outcome == ReadOutcome::kRefused) {
        say("an image was refused; `tubectl top` says why the daemon refuses them");
        continue;
      }
      if (outcome != ReadOutcome::kFrame) return true;
      if (last_number_ && frame_.frame_number > *last_number_ + 1) {
        missed_ += frame_.frame_number - *last_number_ - 1;
      }
      last_number_ = frame_.frame_number;
      const bool fits = frame_.width == size_[0] && frame_.height == size_[1];
      if (frame_.fluoroscopy_on && !fits) {
        ++missed_;
        say("its images are " + std::to_string(frame_.width) + " x " + std::to_string(frame_.height) +
            " px, configured are " + std::to_string(size_[0]) + " x " + std::to_string(size_[1]));
      } else {
        recorder_.add(camera_, frame_);
      }
    }
    return true;
  }

  void say(const std::string& words) {
    if (words == said_) return;
    said_ = words;
    std::cerr << "tubectl: camera " + name_ + ": " + words + "\n";
  }

  std::string name_;
  int camera_;
  std::unique_ptr<ImageSource> source_;
  RunRecorder& recorder_;
  ImageFrame frame_;
  std::array<int, 2> size_{};
  std::optional<std::uint32_t> last_number_;
  std::string said_;
  std::atomic<std::uint64_t> missed_{0};
  std::atomic<bool> is_over_{false};
  std::thread thread_;
};

std::string progress_of(const RunRecorder::Counts& counts,
                        const std::vector<std::unique_ptr<RecordedCamera>>& cameras) {
  std::string words = std::to_string(counts.measurements) + " measurements";
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    words += ", " + std::to_string(counts.images.at(c)) + " images of " + cameras[c]->name();
  }
  return words;
}

/// Until the time is over, or somebody asks to end. How many measurements were lost on the way.
std::uint64_t listen(const RecordOptions& options, const InstrumentDescription& instrument,
                     RunRecorder& recorder, const std::vector<std::unique_ptr<RecordedCamera>>& cameras) {
  Subscription subscription = options.subscription;
  subscription.instrument_id = instrument.id;
  const auto reader = std::make_unique<TopicReader<tubed_EmSamples>>(subscription);
  const MonotonicTime begin = monotonic_now();
  MonotonicTime told = begin;
  const bool is_watched = isatty(STDERR_FILENO) == 1;
  std::uint64_t lost = 0;
  std::uint64_t last = 0;
  std::int64_t newest_ns = 0;
  while (g_asked_to_end == 0 && !recorder.counts().has_failed &&
         (options.seconds == 0 || seconds_between(begin, monotonic_now()) < options.seconds)) {
    if (const tubed_EmSamples* const samples = reader->wait_for(kWait)) {
      if (last > 0 && samples->sequence_number > last + 1) lost += samples->sequence_number - last - 1;
      last = samples->sequence_number;
      if (samples->measured_monotonic_ns > newest_ns) {
        newest_ns = samples->measured_monotonic_ns;
        recorder.add(from_ns(newest_ns), measurement_of(*samples, instrument, 0));
      }
    }
    if (is_watched && monotonic_now() - told > std::chrono::seconds(1)) {
      told = monotonic_now();
      std::cerr << "\r" << static_cast<int>(seconds_between(begin, told))
                << " s: " << progress_of(recorder.counts(), cameras) << "   " << std::flush;
    }
  }
  if (is_watched) std::cerr << "\n";
  return lost;
}

int told(const RecordOptions& options, std::uint64_t lost, const RunRecorder::Counts& counts,
         const std::vector<std::unique_ptr<RecordedCamera>>& cameras) {
  std::cerr << "tubectl: " << options.folder << ": " << progress_of(counts, cameras) << "\n";
  if (lost > 0) std::cerr << "tubectl: " << lost << " measurements were lost on the network\n";
  for (const auto& camera : cameras) {
    if (camera->missed() > 0) {
      std::cerr << "tubectl: camera " << camera->name() << ": " << camera->missed()
                << " images were missed\n";
    }
  }
  if (counts.late > 0) std::cerr << "tubectl: " << counts.late << " came too late and were left out\n";
  if (counts.crowded_out > 0) {
    std::cerr
        << "tubectl: " << counts.crowded_out
        << " images were left out: they came faster than they could be written; record with fewer images "
           "a second, or for a shorter time\n";
  }
  if (counts.measurements == 0) {
    std::cerr
        << (counts.early > 0
                ? "tubectl: the measurements that came are of another clock than this host's: record on "
                  "the host where tubed runs\n"
                : "tubectl: no daemon published coils in domain " +
                      std::to_string(options.subscription.domain) +
                      ": is tubed running there, in this partition? `tubectl status` says\n");
    return kExitUnavailable;
  }
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    if (counts.images.at(c) > 0) continue;
    std::cerr << "tubectl: camera " << cameras[c]->name()
              << " gave no image: is its grabber running (`tubectl grab`)? With --without-images the coils "
                 "alone are recorded\n";
    return kExitFailed;
  }
  return kExitOk;
}

void say_next(const RecordOptions& options, const Configuration& configuration) {
  const std::string config = configuration.room.reference ? "CONFIG_WITHOUT_EM_REFERENCE" : options.config;
  std::cerr << "tubectl: next: tubectl check " << options.folder << " --config " << config << "\n";
}

/// Domain and room are the configuration's, unless others were given.
void listen_where_it_publishes(const DdsSettings& dds, Subscription& subscription) {
  const Subscription usual;
  if (subscription.domain == usual.domain) subscription.domain = dds.domain;
  if (subscription.partition == usual.partition) subscription.partition = dds.partition;
}

int record(RecordOptions options) {
  const Configuration configuration = load_configuration(options.config);
  const InstrumentDescription instrument = instrument_of(options, configuration);
  listen_where_it_publishes(configuration.dds, options.subscription);
  if (!options.without_images) refuse_unshared(configuration, options);
  if (std::filesystem::exists(options.folder) && !std::filesystem::is_empty(options.folder)) {
    throw std::runtime_error(options.folder + " is there already and not empty; name another folder");
  }
  RoomDescription room = configuration.room;
  room.instruments = {numbered_from_tip(instrument)};
  const std::vector<std::string> remarks = remarks_on(configuration, instrument, options.without_images);
  for (const std::string& remark : remarks)
    std::cerr << "tubectl: " << options.folder << ": " << remark << "\n";
  RunRecorder recorder(options.folder, note_of(options, configuration, remarks), room, monotonic_now());
  std::vector<std::unique_ptr<RecordedCamera>> cameras;
  for (std::size_t c = 0; c < room.cameras.size() && !options.without_images; ++c) {
    cameras.push_back(std::make_unique<RecordedCamera>(configuration, static_cast<int>(c), recorder));
  }
  const std::uint64_t lost = listen(options, instrument, recorder, cameras);
  const std::size_t waiting_bytes = recorder.counts().waiting_bytes;
  if (waiting_bytes > kMuch_bytes) {
    std::cerr << "tubectl: writing the " << (waiting_bytes >> 20U)
              << " MB of images that wait; Ctrl-C drops them\n";
  }
  try {
    recorder.finish();
  } catch (const SequenceError&) {
    std::cerr << "tubectl: kept: " << progress_of(recorder.counts(), cameras) << "\n";
    throw;
  }
  const int exit_code = told(options, lost, recorder.counts(), cameras);
  if (exit_code == kExitOk) say_next(options, configuration);
  return exit_code;
}

}  // namespace

CommandLine add_record(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<RecordOptions>();
  CommandLine verb = app.add_subcommand(
      "record",
      "Record what a running daemon's tracker and fluoroscopes give, as a sequence folder for `check`, "
      "`calibrate`, `reconstruct` and `view`");
  verb.add_option("FOLDER", options->folder, "Sequence folder to write, format 1; new or empty").required();
  verb.add_option("--config", options->config, "The daemon's configuration").capture_default_str();
  verb.add_option("--seconds", options->seconds, "Stop after this time").positive().default_str("at Ctrl-C");
  verb.add_flag("--without-images", options->without_images, "Record the coils alone");
  add_dds_options(verb, options->subscription);
  verb.footer("Example:\n  tubectl record run-1 --seconds 30");
  verb.callback([options, &exit_code] {
    // A second one ends it at once.
    struct sigaction once {};
    once.sa_handler = [](int) { g_asked_to_end = 1; };
    once.sa_flags = static_cast<int>(SA_RESETHAND);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) sigaction(signal, &once, nullptr);
    exit_code = record(*options);
  });
  return verb;
}

}  // namespace tubed
