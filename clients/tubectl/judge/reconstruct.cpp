// tubectl reconstruct: a sequence folder to shapes, offline.
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "clients/evaluation/configured_sequence.hpp"
#include "clients/evaluation/estimate_rows.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct ReconstructOptions {
  std::string sequence;
  std::string mode = "filter";
  std::string area = "band";
  std::string out = "est.csv";
  std::string json;
  std::string config;       ///< empty: the sequence's own room, default settings
  bool mode_given = false;  ///< on the command line, beside `config`
  bool area_given = false;
};

/// One line on a terminal, rewritten; one line at the end otherwise.
class Progress {
 public:
  explicit Progress(std::size_t total) : total_(total), live_(isatty(STDERR_FILENO) == 1) {}
  void step(const TubeEstimate& estimate) {
    ++done_;
    ++validities_[std::string(name_of(estimate.validity))];
    count_reasons(estimate.reasons);
    if (live_ || done_ == total_) {
      std::cerr << (live_ ? "\r" : "") << done_ << " of " << total_ << " instants, "
                << std::lround(per_second()) << " a second" << (live_ ? "   " : "")
                << (done_ == total_ ? "\n" : "") << std::flush;
    }
  }
  [[nodiscard]] double per_second() const { return static_cast<double>(done_) / std::max(seconds(), 1e-9); }
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  [[nodiscard]] std::size_t done() const { return done_; }
  [[nodiscard]] const std::map<std::string, int>& validities() const { return validities_; }
  /// Of instants that are not VALID for them, and of those that are and say so all the same.
  [[nodiscard]] const std::map<std::string, int>& reasons() const { return reasons_; }
  /// "QUESTIONABLE 25, VALID 312; reasons: AMBIGUOUS 5, EM_IMAGE_DISAGREE 20".
  [[nodiscard]] std::string summary() const {
    std::string text;
    for (const auto& [word, count] : validities_) {
      text += (text.empty() ? "" : ", ") + word + " " + std::to_string(count);
    }
    std::string why;
    for (const auto& [word, count] : reasons_) {
      why += (why.empty() ? "" : ", ") + word + " " + std::to_string(count);
    }
    return text + (why.empty() ? "" : "; reasons: " + why);
  }

 private:
  void count_reasons(Reasons reasons) {
    for (int bit = 0; bit < kReasonCount; ++bit) {
      const auto reason = static_cast<Reason>(1U << static_cast<unsigned>(bit));
      if (reasons.has(reason) && reason != Reason::kReplayData) ++reasons_[std::string(name_of(reason))];
    }
  }

  std::size_t total_;
  bool live_;
  std::size_t done_ = 0;
  std::map<std::string, int> validities_;
  std::map<std::string, int> reasons_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What the command line says goes before what the configuration says.
ConfiguredSequence configured(const ReconstructOptions& options) {
  ConfiguredSequence run{read_sequence(options.sequence), {}, {}, kUsualMaxImageTimeout};
  if (!options.config.empty()) {
    run = as_configured(std::move(run.sequence), std::filesystem::path(options.config));
  }
  if (options.config.empty() || options.mode_given) {
    run.estimator.mode = mode_named(options.mode).value_or(EstimatorMode::kJoint);
  }
  if (options.config.empty() || options.area_given) {
    run.frangi.area = options.area == "frame" ? FrangiArea::kFrame : FrangiArea::kBand;
  }
  return run;
}

int run(const ReconstructOptions& options) {
  const ConfiguredSequence run = configured(options);
  const Sequence& sequence = run.sequence;
  std::ofstream out(options.out);
  if (!out) {
    std::cerr << "tubectl reconstruct: cannot write " << options.out
              << "; does the folder exist, may you write there?\n";
    return 1;
  }
  write_estimate_header(out);
  Progress progress(instants_of(sequence).size());
  reconstruct(
      sequence, run.estimator, run.frangi,
      [&](const SequenceInstant& instant, const TubeEstimate& estimate) {
        write_estimate_rows(out, instant.frame, estimate);
        progress.step(estimate);
      },
      run.max_image_timeout);
  if (!out.flush()) {
    std::cerr << "tubectl reconstruct: writing " << options.out << " failed; is the disk full?\n";
    return 1;
  }
  std::cerr << progress.summary() << '\n';
  if (!options.json.empty()) {
    const nlohmann::json report = {{"sequence", options.sequence},
                                   {"mode", std::string(name_of(run.estimator.mode))},
                                   {"instants", progress.done()},
                                   {"seconds", progress.seconds()},
                                   {"instants_per_s", progress.per_second()},
                                   {"validity", progress.validities()},
                                   {"reasons", progress.reasons()}};
    if (options.json == "-") {
      std::cout << report.dump(2) << '\n';
    } else {
      std::ofstream(options.json) << report.dump(2) << '\n';
    }
  }
  return 0;
}

}  // namespace

CommandLine add_reconstruct(CommandLine app, int& exit_code) {
  auto options = std::make_shared<ReconstructOptions>();
  CommandLine verb =
      app.add_subcommand("reconstruct", "Estimate the shape at every instant of a sequence folder, offline");
  verb.add_option("SEQUENCE", options->sequence, "sequence folder, format 1").required();
  verb.add_option("--config", options->config,
                  "reconstruct as a daemon with this configuration would: its registration, cameras, coils "
                  "and settings; --mode and --area go before it");
  Argument mode = verb.add_option("--mode", options->mode, mode_meanings());
  mode.is_member(mode_names()).capture_default_str();
  Argument area = verb.add_option(
      "--area", options->area,
      "where images are filtered: band: around the tube; frame: everywhere, as [frangi] area");
  area.is_member({"band", "frame"}).capture_default_str();
  verb.add_option("--out", options->out,
                  "estimates, CSV: frame, s_mm, position, sigma (inf: unknown), validity")
      .capture_default_str();
  verb.add_option("--json", options->json, "summary as JSON to this file, - for standard output");
  verb.callback([options, mode, area, &exit_code] {
    options->mode_given = mode.was_given();
    options->area_given = area.was_given();
    exit_code = run(*options);
  });
  return verb;
}

}  // namespace tubed
