// tubed: reads the configuration, wires drivers, pipeline and publishing together, and waits for the signal
// to end.
#include <pthread.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>

#include "daemon/clock_outlet.hpp"
#include "daemon/config/check_keys.hpp"
#include "daemon/config/load_configuration.hpp"
#include "daemon/config/sample_configuration.hpp"
#include "daemon/dds_outlet.hpp"
#include "daemon/keys_outlet.hpp"
#include "daemon/log.hpp"
#include "daemon/memory_lock.hpp"
#include "daemon/notify_outlet.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/preview_outlet.hpp"
#include "daemon/publishing/start_back_off.hpp"
#include "daemon/publishing/systemd_notify.hpp"
#include "daemon/reload.hpp"
#include "daemon/rival_outlet.hpp"
#include "daemon/shm_outlet.hpp"
#include "daemon/start_limits.hpp"
#include "idl/command_line/command_line.hpp"
#include "idl/cyclone_log.hpp"
#include "idl/printable_text.hpp"

namespace {

// sysexits.h, as systemd's RestartPreventExitStatus= expects them.
constexpr int kExitUnavailable = 69;
constexpr int kExitConfiguration = 78;

/// Signals that end or concern the daemon are taken in main alone; threads inherit the mask.
sigset_t block_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGHUP);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  return signals;
}

tubed::PipelineParts make_parts(const tubed::Configuration& configuration) {
  tubed::PipelineParts parts;
  parts.em_source = tubed::make_em_source(configuration);
  for (std::size_t camera = 0; camera < configuration.room.cameras.size(); ++camera) {
    parts.image_sources.push_back(tubed::make_image_source(configuration, static_cast<int>(camera)));
  }
  for (std::size_t i = 0; i < configuration.room.instruments.size(); ++i) {
    parts.estimators.push_back(tubed::make_estimator(configuration.estimators[i],
                                                     configuration.room.instruments[i], configuration.room));
  }
  return parts;
}

/// A thread with real-time scheduling must not wait for a page either.
bool wants_real_time(const tubed::PipelineSettings& settings) {
  return settings.em_acquisition.fifo_priority > 0 || settings.image_grab.fifo_priority > 0 ||
         settings.frangi.fifo_priority > 0 || settings.view.fifo_priority > 0 ||
         settings.optimizer.fifo_priority > 0 || settings.publisher.fifo_priority > 0;
}

void lock_memory_if_wanted(const tubed::PipelineSettings& settings) {
  if (!wants_real_time(settings)) {
    return;
  }
  const std::string refusal = tubed::lock_memory();
  if (!refusal.empty() && !settings.scheduling_optional) {
    throw std::runtime_error(refusal + ", or set scheduling = \"optional\"");
  }
  if (!refusal.empty()) {
    spdlog::warn("{} (going on without)", refusal);
  }
}

void reload(tubed::ReloadableConfiguration& configuration, const tubed::SystemdNotify& notify,
            tubed::Pipeline& pipeline) {
  notify.reloading(std::chrono::steady_clock::now());
  const tubed::ReloadOutcome outcome = configuration.reload();
  for (const std::string& notice : outcome.notices) {
    spdlog::log(outcome.is_taken ? spdlog::level::warn : spdlog::level::err, "reload: {}", notice);
  }
  if (outcome.is_taken) {
    spdlog::set_level(spdlog::level::from_str(outcome.log_level));
    for (std::size_t camera = 0; camera < outcome.views.size(); ++camera) {
      pipeline.look_from(camera, outcome.views[camera]);
    }
    spdlog::info("reload: done{}", outcome.views.empty() ? "" : ", with other poses of the cameras");
  }
  notify.reloaded();
}

/// Until a signal asks for the end; SIGHUP reads the configuration again.
int wait_for_the_end(const sigset_t& signals, const tubed::Configuration& configuration,
                     const tubed::SystemdNotify& notify, tubed::Pipeline& pipeline) {
  tubed::ReloadableConfiguration reloadable(configuration);
  int signal = 0;
  while (sigwait(&signals, &signal) == 0 && signal == SIGHUP) {
    reload(reloadable, notify, pipeline);
  }
  notify.stopping();
  return signal;
}

/// False when a signal asked for the end meanwhile.
bool wait_after_failed_starts(unsigned failed, const sigset_t& signals) {
  if (failed == 0) return true;
  const auto wait = tubed::back_off_after(failed);
  spdlog::warn("{}{} start(s) in a row ended before a shape was published: waiting {} ms before this one",
               failed, failed > tubed::kMaxCountedStarts ? " or more" : "", wait.count());
  const timespec timeout{wait.count() / 1000, wait.count() % 1000 * 1'000'000};
  sigset_t ending = signals;
  sigdelset(&ending, SIGHUP);
  return sigtimedwait(&ending, nullptr, &timeout) < 0;
}

int run_daemon(const tubed::Configuration& configuration) {
  const sigset_t signals = block_signals();
  tubed::require_limits(configuration);
  tubed::start_logging(configuration.log_level);
  tubed::route_cyclone_log({.say = [](std::string_view words) { spdlog::warn("Cyclone DDS: {}", words); },
                            .monotonic_ns = [] { return tubed::read_clocks().monotonic_ns; }});
  for (const std::string& warning : configuration.warnings) {
    spdlog::warn("{}", warning);
  }
  tubed::StartBackOff back_off(tubed::runtime_directory_of_environment());
  if (!wait_after_failed_starts(back_off.begin(), signals)) {
    back_off.succeed();
    return 0;
  }
  lock_memory_if_wanted(configuration.pipeline);
  tubed::DdsOutlet dds(configuration);
  std::unique_ptr<tubed::ShmOutlet> shm;
  if (!configuration.shm.estimates_socket.empty()) {
    shm = std::make_unique<tubed::ShmOutlet>(configuration, dds.daemon_start(), dds);
  }
  tubed::SystemdNotify notify;
  tubed::NotifyOutlet notified(configuration, notify, back_off,
                               shm ? static_cast<tubed::Outlet&>(*shm) : dds);
  tubed::ClockOutlet timed(configuration, notified);
  tubed::RivalOutlet rivals(configuration, dds.participant(), timed);
  tubed::KeysOutlet outlet(configuration, rivals);
  std::unique_ptr<tubed::ShmPreviewOutlet> previews;
  if (!configuration.shm.preview_folder.empty()) {
    previews = std::make_unique<tubed::ShmPreviewOutlet>(configuration);
  }
  tubed::Pipeline pipeline(make_parts(configuration), configuration.room, configuration.frangi,
                           configuration.pipeline, outlet, previews.get());
  if (wants_real_time(configuration.pipeline)) tubed::populate_heap();
  for (const std::string& refusal : pipeline.start()) {
    spdlog::warn("{} (going on with default scheduling)", refusal);
  }
  spdlog::info("tubed {} tracks {} instrument(s) with {} camera(s), configuration {}", TUBED_VERSION,
               configuration.room.instruments.size(), configuration.room.cameras.size(),
               configuration.file.string());
  const int signal = wait_for_the_end(signals, configuration, notify, pipeline);
  back_off.succeed();
  spdlog::info("{}: ending", signal == SIGINT ? "SIGINT" : "SIGTERM");
  return 0;
}

/// Everything but the last net.
int run(int argc, char** argv) {
  tubed::Program program(
      "tubed: where the whole catheter is in 3D, 30 times a second. Research software, not a medical "
      "device.");
  tubed::CommandLine app = program.command_line();
  std::string file = "/etc/tubed/tubed.toml";
  std::optional<std::string> checked;
  app.add_option("-c,--config", file, "configuration, TOML").capture_default_str();
  app.add_option("--check", checked,
                 "read and check this configuration, or that of --config; say what is wrong, and end")
      .expected(0, 1);
  bool print_sample = false;
  app.add_flag("--sample", print_sample, "print a configuration with every key explained, and end");
  program.set_version("tubed " TUBED_VERSION);
  if (const auto ended = program.parse(argc, argv)) {
    return *ended;
  }
  if (checked && !checked->empty()) file = *checked;
  if (print_sample) {
    std::cout << tubed::sample_configuration();
    return 0;
  }
  try {
    const tubed::Configuration configuration = tubed::load_configuration(file);
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    tubed::check_keys(configuration, std::chrono::duration_cast<std::chrono::seconds>(now).count());
    if (!checked) {
      return run_daemon(configuration);
    }
    for (const std::string& warning : configuration.warnings) {
      std::cerr << warning << '\n';
    }
    std::cout << file << ": ok\n";
    return 0;
  } catch (const tubed::ConfigurationError& error) {
    std::cerr << error.what() << '\n';
    return kExitConfiguration;
  } catch (const std::invalid_argument& error) {
    // What the configuration names cannot be used, a vessel that is no vessel: trying again does not help.
    std::cerr << tubed::printable_text(file + ": " + error.what()) << '\n';
    return kExitConfiguration;
  } catch (const std::bad_alloc&) {
    std::cerr
        << "tubed: cannot start: out of memory; raise RLIMIT_AS and RLIMIT_DATA (ulimit -v, ulimit -d)\n";
    return kExitUnavailable;
  } catch (const std::exception& error) {
    std::cerr << "tubed: cannot start: " << tubed::printable_text(error.what()) << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

int main(int argc, char** argv) {
  int status = kExitUnavailable;
  try {
    tubed::require_stack();
    status = run(argc, argv);
    spdlog::shutdown();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tubed: cannot start: %s\n", error.what());
  }
  return status;
}
