// tubectl reconstruct: a sequence folder to shapes, offline.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "clients/tubectl/estimate_rows.hpp"
#include "clients/tubectl/offline_reconstruction.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct ReconstructOptions {
  std::string sequence;
  std::string mode = "filter";
  std::string area = "band";
  std::string out = "est.csv";
  std::string json;
};

/// One line on a terminal, rewritten; one line at the end otherwise.
class Progress {
 public:
  explicit Progress(std::size_t total) : total_(total), live_(isatty(STDERR_FILENO) == 1) {}
  void step(const TubeEstimate& estimate) {
    ++done_;
    ++validities_[std::string(name_of(estimate.validity))];
    if (live_ || done_ == total_) {
      std::cerr << (live_ ? "\r" : "") << done_ << " of " << total_ << " instants, " << per_second()
                << " a second   " << (done_ == total_ ? "\n" : "") << std::flush;
    }
  }
  [[nodiscard]] double per_second() const { return static_cast<double>(done_) / std::max(seconds(), 1e-9); }
  [[nodiscard]] double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  [[nodiscard]] std::size_t done() const { return done_; }
  [[nodiscard]] const std::map<std::string, int>& validities() const { return validities_; }

 private:
  std::size_t total_;
  bool live_;
  std::size_t done_ = 0;
  std::map<std::string, int> validities_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

int run(const ReconstructOptions& options) {
  const Sequence sequence = read_sequence(options.sequence);
  EstimatorSettings settings;
  settings.mode = mode_named(options.mode).value_or(EstimatorMode::kJoint);
  FrangiSettings frangi;
  frangi.area = options.area == "frame" ? FrangiArea::kFrame : FrangiArea::kBand;
  std::ofstream out(options.out);
  if (!out) {
    std::cerr << "tubectl reconstruct: cannot write " << options.out
              << "; does the folder exist, may you write there?\n";
    return 1;
  }
  write_estimate_header(out);
  Progress progress(instants_of(sequence).size());
  reconstruct(sequence, settings, frangi, [&](const SequenceInstant& instant, const TubeEstimate& estimate) {
    write_estimate_rows(out, instant.frame, estimate);
    progress.step(estimate);
  });
  if (!out.flush()) {
    std::cerr << "tubectl reconstruct: writing " << options.out << " failed; is the disk full?\n";
    return 1;
  }
  if (!options.json.empty()) {
    const nlohmann::json report = {{"sequence", options.sequence},
                                   {"mode", options.mode},
                                   {"instants", progress.done()},
                                   {"seconds", progress.seconds()},
                                   {"instants_per_s", progress.per_second()},
                                   {"validity", progress.validities()}};
    if (options.json == "-") {
      std::cout << report.dump(2) << '\n';
    } else {
      std::ofstream(options.json) << report.dump(2) << '\n';
    }
  }
  return 0;
}

}  // namespace

CLI::App* add_reconstruct(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReconstructOptions>();
  CLI::App* verb =
      app.add_subcommand("reconstruct", "Estimate the shape at every instant of a sequence folder, offline");
  verb->add_option("SEQUENCE", options->sequence, "sequence folder, format 1")->required();
  verb->add_option("--mode", options->mode,
                   "em: coils only; paper: as published; joint: coils and images of each instant; filter: "
                   "with what was known before")
      ->check(CLI::IsMember({"em", "paper", "joint", "filter"}))
      ->capture_default_str();
  verb->add_option("--area", options->area,
                   "where images are filtered: band: around the tube; frame: everywhere, as [frangi] area")
      ->check(CLI::IsMember({"band", "frame"}))
      ->capture_default_str();
  verb->add_option("--out", options->out, "estimates, CSV: frame, s_mm, position, sigma, validity")
      ->capture_default_str();
  verb->add_option("--json", options->json, "summary as JSON to this file, - for standard output");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
  return verb;
}

}  // namespace tubed
