// tubectl calibrate camera: intrinsics, distortion and pose from images of a phantom.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "clients/calibration/camera_calibration.hpp"
#include "clients/calibration/camera_report.hpp"
#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/calibrate/calibrate_camera.hpp"
#include "clients/tubectl/verbs.hpp"
#include "daemon/config/load_configuration.hpp"
#include "drivers/replay/sequence_folder.hpp"

namespace tubed {

namespace {

struct CameraOptions {
  std::vector<std::string> images;
  std::string camera;
  std::string phantom;
  std::string board;
  double square_mm = 0;
  std::string angles;
  std::optional<double> focal_px, pixel_pitch_mm, source_detector_mm, source_isocentre_mm;
  bool mirrored = false;
  std::string polarity = "either";
  std::string json;
  AcceptOptions accept;
};

/// "0,0:30,0": primary and secondary angle, an image each.
std::vector<GantryAngles> angles_from(const std::string& text) {
  std::vector<GantryAngles> angles;
  std::istringstream pairs(text);
  for (std::string pair; std::getline(pairs, pair, ':');) {
    std::istringstream numbers(pair);
    GantryAngles one;
    char comma = 0;
    if (!(numbers >> one.primary_deg >> comma >> one.secondary_deg) || comma != ',' ||
        numbers.peek() != EOF) {
      throw PhantomError("--angles: \"" + pair +
                         "\" is no pair of angles; write primary,secondary:primary,secondary");
    }
    if (std::abs(one.primary_deg) > 180 || std::abs(one.secondary_deg) > 90) {
      throw PhantomError("--angles: \"" + pair +
                         "\": expected a primary angle of -180 to 180 deg and a secondary "
                         "one of -90 to 90 deg");
    }
    angles.push_back(one);
  }
  return angles;
}

Chequerboard board_from(const CameraOptions& options) {
  std::istringstream text(options.board);
  Chequerboard board;
  char by = 0;
  if (!(text >> board.columns >> by >> board.rows) || by != 'x' || text.peek() != EOF || board.columns < 3 ||
      board.rows < 3) {
    throw PhantomError("--board: write COLUMNSxROWS of inner corners, 3 or more each, such as 9x6");
  }
  if (!(options.square_mm > 0)) throw PhantomError("--board needs --square, the side of a square in mm");
  board.square_mm = options.square_mm;
  return board;
}

/// Files as they are; of a sequence folder the images of that camera.
std::vector<CalibrationPicture> pictures_of(const CameraOptions& options) {
  std::vector<CalibrationPicture> pictures;
  for (const std::string& name : options.images) {
    if (!std::filesystem::is_directory(name)) {
      pictures.push_back(read_calibration_picture(name));
      continue;
    }
    const Sequence sequence = read_sequence(name);
    for (const SequenceFrame& frame : sequence.frames) {
      const CameraCalibration& camera = sequence.room.cameras[static_cast<std::size_t>(frame.camera)];
      if (frame.fluoroscopy_on() && camera.name == options.camera) {
        pictures.push_back(read_calibration_picture(sequence.folder / frame.file));
      }
    }
  }
  if (pictures.empty()) throw PhantomError("no image of camera \"" + options.camera + "\" was found");
  return pictures;
}

std::optional<CameraCalibration> configured_camera(const CameraOptions& options) {
  if (options.accept.config.empty()) return std::nullopt;
  const Configuration configuration = load_configuration(options.accept.config);
  std::string names;
  for (const CameraCalibration& camera : configuration.room.cameras) {
    if (camera.name == options.camera) return camera;
    names += " \"" + camera.name + "\"";
  }
  throw PhantomError(options.accept.config + ": has no camera \"" + options.camera + "\"; it has" +
                     (names.empty() ? " none" : names));
}

CameraSettings settings_of(const CameraOptions& options) {
  CameraSettings settings;
  settings.camera = options.camera;
  settings.mirrored = options.mirrored;
  settings.focal_px = options.focal_px;
  settings.angles = angles_from(options.angles);
  settings.pixel_pitch_mm = options.pixel_pitch_mm;
  settings.source_detector_mm = options.source_detector_mm;
  settings.source_isocentre_mm = options.source_isocentre_mm;
  settings.look.polarity = options.polarity == "dark"     ? BallLook::Polarity::kDark
                           : options.polarity == "bright" ? BallLook::Polarity::kBright
                                                          : BallLook::Polarity::kEither;
  settings.configured = configured_camera(options);
  return settings;
}

const char* word_of(ReportVerdict verdict) {
  return verdict == ReportVerdict::kGood ? "good" : verdict == ReportVerdict::kDoubtful ? "doubtful" : "BAD";
}

nlohmann::json json_of(const CameraFindings& findings) {
  const CameraCalibration camera = findings.calibration();
  nlohmann::json json{{"camera", camera.name},
                      {"usable", findings.is_usable()},
                      {"fx", camera.fx},
                      {"fy", camera.fy},
                      {"cx", camera.cx},
                      {"cy", camera.cy},
                      {"distortion", camera.distortion},
                      {"mirrored", camera.mirrored},
                      {"calibration_residual_px", *camera.calibration_residual_px},
                      {"pose_sigma_mm", *camera.pose_sigma_mm},
                      {"pose_sigma_deg", *camera.pose_sigma_deg},
                      {"focal_sigma", *camera.focal_sigma}};
  for (const CameraStatement& statement : findings.statements) {
    json["statements"].push_back({{"verdict", word_of(statement.verdict)}, {"words", statement.words}});
  }
  return json;
}

int calibrate(const CameraOptions& options) {
  if (options.phantom.empty() == options.board.empty()) {
    throw PhantomError("give --phantom FILE with the places of steel balls, or --board with --square");
  }
  if (options.source_detector_mm && options.source_isocentre_mm &&
      *options.source_isocentre_mm >= *options.source_detector_mm) {
    throw PhantomError(
        "--source-isocentre has to be less than --source-detector: the isocentre lies between source and "
        "detector");
  }
  const CameraSettings settings = settings_of(options);
  const std::vector<CalibrationPicture> pictures = pictures_of(options);
  const CameraFindings findings =
      options.phantom.empty() ? calibrate_with_board(pictures, board_from(options), settings)
                              : calibrate_with_balls(pictures, read_ball_phantom(options.phantom), settings);
  for (const CalibratedImage& image : findings.images) {
    std::cerr << image.name << ": " << image.matched << " of " << image.in_image << " points\n";
  }
  for (const CameraStatement& statement : findings.statements) {
    std::cerr << word_of(statement.verdict)
              << std::string(11 - std::string(word_of(statement.verdict)).size(), ' ') << statement.words
              << '\n';
  }
  write_report(camera_report(findings), options.accept);
  if (options.json == "-") {
    std::cout << json_of(findings).dump(2) << '\n';
  }
  if (!findings.is_usable()) {
    std::cerr << "Nothing is offered before that is put right.\n";
    return kExitFailed;
  }
  const ConfigurationFragment fragment = fragment_of(findings);
  return options.json == "-" ? offer_beside_json(fragment, options.accept) : offer(fragment, options.accept);
}

int saying_what_is_wrong(const CameraOptions& options) {
  try {
    return calibrate(options);
  } catch (const std::runtime_error& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitBadData;
  }
}

// A source's distances and a focal length that go with the configuration's c_arm and the pitches here.
constexpr double kMinDistance_mm = 100, kMaxDistance_mm = 3000;
constexpr double kMinPitch_mm = 0.02, kMaxPitch_mm = 2;

void add_physical_options(CommandLine verb, CameraOptions& options) {
  verb.add_option("--square", options.square_mm, "Side of the board's squares, mm")
      .in_range(0.1, 1000.0, "mm");
  verb.add_option("--angles", options.angles,
                  "Of a C-arm, deg, an image each: primary,secondary:primary,...");
  verb.add_option("--pitch", options.pixel_pitch_mm, "Of the image's pixels at the detector, mm")
      .in_range(kMinPitch_mm, kMaxPitch_mm, "mm");
  verb.add_option("--source-detector", options.source_detector_mm, "As the console says, mm: for comparison")
      .in_range(kMinDistance_mm, kMaxDistance_mm, "mm");
  verb.add_option("--source-isocentre", options.source_isocentre_mm, "As the console says, mm: held")
      .in_range(kMinDistance_mm, kMaxDistance_mm, "mm");
  verb.add_option("--focal", options.focal_px, "Focal length that is known, px: held")
      .in_range(kMinDistance_mm / kMaxPitch_mm, kMaxDistance_mm / kMinPitch_mm, "px");
}

}  // namespace

CommandLine add_calibrate_camera(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<CameraOptions>();
  CommandLine verb =
      app.add_subcommand("camera", "Find intrinsics, distortion and pose from images of a phantom");
  verb.add_option("IMAGE", options->images,
                  "PNG of 8 or 16 bit grey, or a sequence folder; several of one camera")
      .required();
  verb.add_option("--camera", options->camera, "Its name in the configuration").required();
  verb.add_option("--phantom", options->phantom, "Phantom of steel balls: places and diameters, TOML");
  verb.add_option("--board", options->board, "Chequerboard instead: inner corners, COLUMNSxROWS");
  add_physical_options(verb, *options);
  verb.add_flag("--mirrored", options->mirrored, "Images come as seen from the detector");
  verb.add_option("--balls", options->polarity, "dark, bright or either")
      .is_member({"dark", "bright", "either"})
      .capture_default_str();
  verb.add_option("--json", options->json, "- for the findings as JSON on standard output").is_member({"-"});
  add_accept_options(verb, options->accept);
  verb.footer(
      "Example:\n  tubectl calibrate camera image-*.png --phantom phantom.toml --camera A --config "
      "/etc/tubed/tubed.toml");
  verb.callback([options, &exit_code] { exit_code = saying_what_is_wrong(*options); });
  return verb;
}

}  // namespace tubed
