// tubectl explain: what one image of a sequence showed, and what was made of it, as pictures.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "clients/tubectl/explanation_picture.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct ExplainOptions {
  std::string sequence;
  ExplainedImage image;
  std::string mode = "filter";
  std::string out = "explained";
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

int explain(const ExplainOptions& options) {
  const Sequence sequence = read_sequence(options.sequence);
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
  verb->add_option("--image", options->image.frame, "frame number of the image, as in frames.csv")
      ->required();
  verb->add_option("--camera", options->image.camera,
                   "name of the view, where two took an image at that instant; left out: the frame's own");
  verb->add_option("--mode", options->mode, "of the reconstruction up to that image")
      ->check(CLI::IsMember({"em", "paper", "joint", "filter"}))
      ->capture_default_str();
  verb->add_option("--out", options->out, "folder for the pictures; made when it is not there")
      ->capture_default_str();
  verb->callback([options, &exit_code] { exit_code = explain(*options); });
  return verb;
}

}  // namespace tubed
