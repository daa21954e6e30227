// tubectl view: a recording in a browser, with a time line.
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <iostream>
#include <memory>
#include <thread>

#include "clients/evaluation/configured_sequence.hpp"
#include "clients/playback/playback.hpp"
#include "clients/tubectl/verbs.hpp"
#include "clients/view/ending_signals.hpp"
#include "clients/view/server_options.hpp"

namespace tubed {

namespace {

struct ViewOptions {
  std::string sequence;
  std::string config;  ///< empty: the sequence's own room, default settings
  std::string mode = "filter";
  bool mode_given = false;  ///< on the command line, beside `config`
  ServerOptions server;
};

ConfiguredSequence configured(const ViewOptions& options) {
  ConfiguredSequence run{read_sequence(options.sequence), {}, {}, kUsualMaxImageTimeout};
  if (run.sequence.frames.empty()) {
    throw std::runtime_error(options.sequence + ": frames.csv has no row, so there is no instant to show");
  }
  if (!options.config.empty()) {
    run = as_configured(std::move(run.sequence), std::filesystem::path(options.config));
  }
  if (options.config.empty() || options.mode_given) {
    run.estimator.mode = mode_named(options.mode).value_or(EstimatorMode::kFilter);
  }
  return run;
}

/// Says how far the reconstruction is until it is done or cannot go on.
void report(const Playback& playback, const std::atomic<bool>& must_end) {
  const bool is_live = isatty(STDERR_FILENO) == 1;
  while (!must_end) {
    const std::string trouble = playback.trouble();
    const bool is_over = playback.ready() == playback.total() || !trouble.empty();
    if (is_live || is_over) {
      std::cerr << (is_live ? "\r" : "") << playback.ready() << " of " << playback.total()
                << " instants reconstructed" << std::flush;
    }
    if (is_over) {
      std::cerr << '\n';
      if (!trouble.empty()) {
        std::cerr << "tubectl view: " << trouble << "\nthe page shows what was made before that\n";
      }
      return;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
}

int run(const ViewOptions& options) {
  WebServerSettings server;
  try {
    server = server_settings(options.server);
  } catch (const std::invalid_argument& error) {
    std::cerr << "tubectl view: " << error.what() << '\n';
    return kExitUsage;
  }
  const EndingSignals ending;
  Playback playback(configured(options), std::move(server));
  std::cerr << "open " << address_of(options.server) << " in a browser; Ctrl-C here ends\n";
  std::atomic<bool> must_end{false};
  std::thread reporting([&] { report(playback, must_end); });
  std::thread waiting([&] {
    ending.wait();
    playback.stop();
  });
  playback.run();
  must_end = true;
  reporting.join();
  waiting.join();
  return kExitOk;
}

}  // namespace

CommandLine add_view(CommandLine app, int& exit_code) {
  auto options = std::make_shared<ViewOptions>();
  CommandLine verb = app.add_subcommand(
      "view",
      "Show a sequence folder in a browser, with a time line: images, shapes, what the coils alone say, and "
      "the truth where it is known");
  verb.add_option("SEQUENCE", options->sequence, "sequence folder, format 1").required();
  verb.add_option("--config", options->config,
                  "as a daemon with this configuration would see it: its registration, cameras, coils and "
                  "settings; --mode goes before it");
  Argument mode = verb.add_option("--mode", options->mode, mode_meanings());
  mode.is_member(mode_names()).capture_default_str();
  add_server_options(verb, options->server);
  verb.callback([options, mode, &exit_code] {
    options->mode_given = mode.was_given();
    exit_code = run(*options);
  });
  return verb;
}

}  // namespace tubed
