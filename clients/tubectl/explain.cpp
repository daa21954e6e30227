// tubectl explain: what one image of a sequence showed, and what was made of it, as pictures.
#include <CLI/CLI.hpp>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "clients/tubectl/explanation_picture.hpp"
#include "clients/tubectl/registration.hpp"
#include "clients/tubectl/statistics.hpp"
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
};

void write_picture(const std::filesystem::path& file, const cv::Mat& picture) {
  bool written = false;
  try {
    written = cv::imwrite(file.string(), picture);
  } catch (const cv::Exception&) {
    written = false;
  }
  if (!written) {
    throw std::runtime_error(file.string() + " cannot be written; may you write there?");
  }
  std::cout << file.string() << '\n';
}

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

int compare(const Sequence& sequence, const ExplainOptions& options) {
  nlohmann::json all = nlohmann::json::array();
  std::string summaries;
  for (const RegistrationMethod& method : registration_methods()) {
    const auto images = register_images(sequence, method.settings, FrangiSettings{});
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
    std::cout << "method               images  median px  95 % px  captured  flagged\n"
              << summaries << "captured: beyond " << kCaptured_px
              << " px at a twentieth of the tube; flagged: of those, not VALID\n";
  }
  return kExitOk;
}

int explain(const ExplainOptions& options) {
  const Sequence sequence = read_sequence(options.sequence);
  if (!options.one_image) {
    return compare(sequence, options);
  }
  EstimatorSettings settings;
  settings.mode = mode_named(options.mode).value_or(EstimatorMode::kFilter);
  const Explanation explanation = explain_image(sequence, options.image, settings, FrangiSettings{});
  for (const std::string& line : words_of(explanation)) {
    std::cout << line << '\n';
  }
  const std::filesystem::path folder = options.out;
  std::filesystem::create_directories(folder);
  const std::string stem =
      "frame" + std::to_string(explanation.frame) + "-" + explanation.camera.name + "-" + options.mode;
  write_picture(folder / (stem + ".png"), draw_sheet(explanation));
  const cv::Mat lines = draw_lines(explanation);
  if (!lines.empty()) {
    write_picture(folder / (stem + "-lines.png"), lines);
    const std::filesystem::path table = folder / (stem + "-lines.csv");
    if (!(std::ofstream(table) << lines_csv(explanation)).flush()) {
      throw std::runtime_error(table.string() + " cannot be written; is the disk full?");
    }
    std::cout << table.string() << '\n';
  }
  return kExitOk;
}

}  // namespace

CLI::App* add_explain(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ExplainOptions>();
  CLI::App* verb = app.add_subcommand(
      "explain",
      "Show what an image of a sequence folder showed and what was made of it: tube before and after, "
      "vesselness, posterior and correspondence lines over the image, as PNG");
  verb->add_option("SEQUENCE", options->sequence, "sequence folder, format 1")->required();
  const CLI::Option* image = verb->add_option(
      "--image", options->image.frame,
      "frame number, as in frames.csv; left out: how far the tube of every image, found from its coils and "
      "itself alone, lies from the projected truth, by each form of the image likelihood");
  verb->add_option("--camera", options->image.camera,
                   "name of the view, where two took an image at that instant; left out: the frame's own");
  verb->add_option("--mode", options->mode, "of the reconstruction up to that image")
      ->check(CLI::IsMember({"em", "paper", "joint", "filter"}))
      ->capture_default_str();
  verb->add_option("--out", options->out, "folder for the pictures; made when it is not there")
      ->capture_default_str();
  verb->add_option("--rows", options->rows, "without --image: so many images, the farthest off first")
      ->capture_default_str();
  verb->add_flag("--json", options->json, "without --image: every image, as JSON");
  verb->callback([options, image, &exit_code] {
    options->one_image = image->count() > 0;
    exit_code = explain(*options);
  });
  return verb;
}

}  // namespace tubed
