// tubed: reads the configuration, wires drivers, pipeline and publishing together, and waits for the signal
// to end.
#include <pthread.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <iostream>
#include <optional>
#include <stdexcept>

#include "daemon/config/load_configuration.hpp"
#include "daemon/config/sample_configuration.hpp"
#include "daemon/dds_outlet.hpp"
#include "daemon/log.hpp"
#include "daemon/memory_lock.hpp"
#include "daemon/notify_outlet.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/publishing/cyclone_log.hpp"
#include "daemon/publishing/systemd_notify.hpp"
#include "daemon/reload.hpp"
#include "daemon/rival_outlet.hpp"
#include "daemon/shm_outlet.hpp"

namespace {

// sysexits.h, as systemd's RestartPreventExitStatus= expects them.
constexpr int kExitUsage = 64;
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

/// Whoever asks for real-time scheduling of a thread does not want it to wait for a page either.
bool wants_real_time(const tubed::PipelineSettings& settings) {
  return settings.em_acquisition.fifo_priority > 0 || settings.image_grab.fifo_priority > 0 ||
         settings.frangi.fifo_priority > 0 || settings.optimizer.fifo_priority > 0 ||
         settings.publisher.fifo_priority > 0;
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

void reload(tubed::ReloadableConfiguration& configuration, const tubed::SystemdNotify& notify) {
  notify.reloading(std::chrono::steady_clock::now());
  const tubed::ReloadOutcome outcome = configuration.reload();
  for (const std::string& notice : outcome.notices) {
    spdlog::log(outcome.is_taken ? spdlog::level::warn : spdlog::level::err, "reload: {}", notice);
  }
  if (outcome.is_taken) {
    spdlog::set_level(spdlog::level::from_str(outcome.log_level));
    spdlog::info("reload: done");
  }
  notify.reloaded();
}

/// Until a signal asks for the end; SIGHUP reads the configuration again.
int wait_for_the_end(const sigset_t& signals, const tubed::Configuration& configuration,
                     const tubed::SystemdNotify& notify) {
  tubed::ReloadableConfiguration reloadable(configuration);
  int signal = 0;
  while (sigwait(&signals, &signal) == 0 && signal == SIGHUP) {
    reload(reloadable, notify);
  }
  notify.stopping();
  return signal;
}

int run_daemon(const tubed::Configuration& configuration) {
  const sigset_t signals = block_signals();
  tubed::start_logging(configuration.log_level);
  tubed::route_cyclone_log([](std::string_view words) { spdlog::warn("Cyclone DDS: {}", words); });
  for (const std::string& warning : configuration.warnings) {
    spdlog::warn("{}", warning);
  }
  lock_memory_if_wanted(configuration.pipeline);
  tubed::DdsOutlet dds(configuration);
  std::optional<tubed::ShmOutlet> shm;
  if (!configuration.shm.estimates_socket.empty()) {
    shm.emplace(configuration, dds.daemon_start(), dds);
  }
  tubed::SystemdNotify notify;
  tubed::NotifyOutlet notified(configuration, notify, shm ? static_cast<tubed::Outlet&>(*shm) : dds);
  tubed::RivalOutlet outlet(configuration, dds.participant(), notified);
  tubed::Pipeline pipeline(make_parts(configuration), configuration.room, configuration.frangi,
                           configuration.pipeline, outlet);
  for (const std::string& refusal : pipeline.start()) {
    spdlog::warn("{} (going on with default scheduling)", refusal);
  }
  spdlog::info("tubed {} tracks {} instrument(s) with {} camera(s), configuration {}", TUBED_VERSION,
               configuration.room.instruments.size(), configuration.room.cameras.size(),
               configuration.file.string());
  const int signal = wait_for_the_end(signals, configuration, notify);
  spdlog::info("{}: ending", signal == SIGINT ? "SIGINT" : "SIGTERM");
  return 0;
}

/// Everything but the last net.
int run(int argc, char** argv) {
  CLI::App app{
      "tubed: where the whole catheter is in 3D, 30 times a second. Research software, not a medical "
      "device."};
  std::string file = "/etc/tubed/tubed.toml";
  bool check_only = false;
  app.add_option("-c,--config", file, "configuration, TOML")->capture_default_str();
  app.add_option_function<std::string>(
      "--check", [&](const std::string& name) { file = name, check_only = true; },
      "read and check a configuration, say what is wrong, and end");
  bool print_sample = false;
  app.add_flag("--sample", print_sample, "print a configuration with every key explained, and end");
  app.set_version_flag("--version", "tubed " TUBED_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kExitUsage;
  }
  if (print_sample) {
    std::cout << tubed::sample_configuration();
    return 0;
  }
  try {
    const tubed::Configuration configuration = tubed::load_configuration(file);
    if (!check_only) {
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
    std::cerr << file << ": " << error.what() << '\n';
    return kExitConfiguration;
  } catch (const std::exception& error) {
    std::cerr << "tubed: cannot start: " << error.what() << '\n';
    return kExitUnavailable;
  }
}

}  // namespace

int main(int argc, char** argv) {
  int status = kExitUnavailable;
  try {
    status = run(argc, argv);
    spdlog::shutdown();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tubed: %s\n", error.what());
  }
  return status;
}
