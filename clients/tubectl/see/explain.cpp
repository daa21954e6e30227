// tubectl explain: what one image of a sequence showed, and what was made of it, as pictures.
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "clients/evaluation/configured_sequence.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/evaluation/registration.hpp"
#include "clients/evaluation/statistics.hpp"
#include "clients/tubectl/see/explanation_picture.hpp"
#include "clients/tubectl/see/picture_file.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct ExplainOptions {
  std::string sequence;
  ExplainedImage image;
  std::string mode = "filter";
  std::string out = "explained";
  std::size_t rows = 5;
  bool json = false;
  bool one_image = false;
  std::string config;       ///< empty: the sequence's own room, default settings
  bool mode_given = false;  ///< on the command line, beside `config`
};

nlohmann::json json_of(const RegistrationMethod& method, const std::vector<RegisteredImage>& images) {
  const RegistrationSummary summary = summary_of(images);
  nlohmann::json rows = nlohmann::json::array();
  for (const RegisteredImage& image : images) {
    rows.push_back({{"frame", image.frame},
                    {"camera", image.camera},
                    {"median_px", quantile(image.distance_px, 0.5)},
                    {"p95_px", quantile(image.distance_px, 0.95)},
                    {"agreeing", image.agreeing},
                    {"validity", std::string(name_of(image.validity))},
                    {"reasons", names_of(image.reasons)}});
  }
  return {{"method", method.name},          {"images", summary.images},
          {"median_px", summary.median_px}, {"p95_px", summary.p95_px},
          {"captured", summary.captured},   {"captured_flagged", summary.flagged},
          {"each_image", std::move(rows)}};
}

int compare(const Sequence& sequence, const FrangiSettings& frangi, const ExplainOptions& options) {
  nlohmann::json all = nlohmann::json::array();
  std::string summaries;
  for (const RegistrationMethod& method : registration_methods()) {
    const auto images = register_images(sequence, method.settings, frangi);
    if (images.empty()) {
      throw std::runtime_error("no image of " + sequence.folder.string() + " shows any of the tube");
    }
    if (options.json) {
      all.push_back(json_of(method, images));
      continue;
    }
    std::cout << method.name << ", farthest off:\n" << table_of(images, options.rows) << '\n';
    const RegistrationSummary summary = summary_of(images);
    std::array<char, 160> line{};
    std::snprintf(line.data(), line.size(), "%-20s %6zu %10.2f %8.2f %9zu %8zu\n", method.name.c_str(),
                  summary.images, summary.median_px, summary.p95_px, summary.captured, summary.flagged);
    summaries += line.data();
  }
  if (options.json) {
    std::cout << all.dump(1) << '\n';
  } else {
    std::cout
        << "method               images  median px  95 % px  captured  flagged\n"
        << summaries << "captured: beyond " << kCaptured_px
        << " px, and outside of the true tube, at a twentieth of its points; flagged: of those, not VALID\n";
  }
  return kExitOk;
}

int explain(const ExplainOptions& options) {
  ConfiguredSequence run{read_sequence(options.sequence), {}, {}, kUsualMaxImageTimeout};
  if (!options.config.empty()) {
    run = as_configured(std::move(run.sequence), std::filesystem::path(options.config));
  }
  if (!options.one_image) {
    return compare(run.sequence, run.frangi, options);
  }
  if (options.config.empty() || options.mode_given) {
    run.estimator.mode = mode_named(options.mode).value_or(EstimatorMode::kFilter);
  }
  const Explanation explanation =
      explain_image(run.sequence, options.image, run.estimator, run.frangi, run.max_image_timeout);
  for (const std::string& line : words_of(explanation)) {
    std::cout << line << '\n';
  }
  const std::filesystem::path folder = options.out;
  std::filesystem::create_directories(folder);
  const std::string stem = "frame" + std::to_string(explanation.frame) + "-" + explanation.camera.name + "-" +
                           std::string(name_of(run.estimator.mode));
  const std::filesystem::path sheet = folder / (stem + ".png");
  write_picture(sheet, draw_sheet(explanation));
  std::cout << sheet.string() << '\n';
  const cv::Mat lines = draw_lines(explanation);
  if (!lines.empty()) {
    const std::filesystem::path picture = folder / (stem + "-lines.png");
    write_picture(picture, lines);
    std::cout << picture.string() << '\n';
    const std::filesystem::path table = folder / (stem + "-lines.csv");
    if (!(std::ofstream(table) << lines_csv(explanation)).flush()) {
      throw std::runtime_error(table.string() + " cannot be written; is the disk full?");
    }
    std::cout << table.string() << '\n';
  }
  return kExitOk;
}

}  // namespace

CommandLine add_explain(CommandLine app, int& exit_code) {
  auto options = std::make_shared<ExplainOptions>();
  CommandLine verb = app.add_subcommand(
      "explain",
      "Show what an image of a sequence folder showed and what was made of it: tube before and after, "
      "vesselness, posterior and correspondence lines over the image, as PNG");
  verb.add_option("SEQUENCE", options->sequence, "sequence folder, format 1").required();
  const Argument image = verb.add_option(
      "--image", options->image.frame,
      "frame number, as in frames.csv; left out: how far the tube of every image, found from its coils and "
      "itself alone, lies from the projected truth, by each form of the image likelihood");
  verb.add_option("--camera", options->image.camera,
                  "name of the view, where two took an image at that instant; left out: the frame's own");
  verb.add_option("--config", options->config,
                  "as a daemon with this configuration would: its registration, cameras, coils and "
                  "settings; --mode goes before it");
  Argument mode = verb.add_option("--mode", options->mode, "of the reconstruction up to that image");
  mode.is_member(mode_names()).capture_default_str();
  verb.add_option("--out", options->out, "folder for the pictures; made when it is not there")
      .capture_default_str();
  verb.add_option("--rows", options->rows, "without --image: so many images, the farthest off first")
      .capture_default_str();
  verb.add_flag("--json", options->json, "without --image: every image, as JSON");
  verb.callback([options, image, mode, &exit_code] {
    options->one_image = image.was_given();
    options->mode_given = mode.was_given();
    exit_code = explain(*options);
  });
  return verb;
}

}  // namespace tubed
