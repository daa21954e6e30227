// tubectl radiograph: pictures of the simulated fluoroscope, for a person to look at.
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/tubectl/see/picture_file.hpp"
#include "clients/tubectl/verbs.hpp"
#include "drivers/laboratory/fluoroscope/c_arm.hpp"
#include "drivers/laboratory/fluoroscope/clutter.hpp"
#include "drivers/laboratory/fluoroscope/console.hpp"
#include "drivers/laboratory/fluoroscope/radiograph.hpp"
#include "drivers/laboratory/fluoroscope/thorax.hpp"
#ifdef TUBED_READS_CT_SERIES
#include "drivers/laboratory/fluoroscope/dicom/ct_series.hpp"
#endif

namespace tubed {

namespace {

struct RadiographArguments {
  std::string out = "radiograph.png";
  std::vector<double> lao_deg{60};
  double cranial_deg = 0;
  std::vector<double> target_mm{0, -20, -95};
  double dose_quanta = DetectorSettings().quanta_per_pixel;
  int bits = 8;
  int frames = 1;
  double rate_hz = 30;
  double start_s = 0;
  double catheter_from_valve_mm = 60;
  std::vector<std::string> clutter;
  std::string ct_folder;
  double voxel_mm = ThoraxSettings().spacing_mm;
  std::int64_t seed = 1;
  bool bare = false;
  bool has_console = false;
};

bool wants(const RadiographArguments& arguments, const char* clutter) {
  return std::find(arguments.clutter.begin(), arguments.clutter.end(), clutter) != arguments.clutter.end();
}

AttenuationVolume patient_of(const RadiographArguments& arguments) {
  if (arguments.ct_folder.empty()) {
    ThoraxSettings settings;
    settings.spacing_mm = arguments.voxel_mm;
    settings.seed = arguments.seed;
    return make_thorax(settings);
  }
#ifdef TUBED_READS_CT_SERIES
  return read_ct_series(arguments.ct_folder);
#else
  throw std::runtime_error(
      "this tubectl was built without DCMTK: install libdcmtk-dev and build again for --ct");
#endif
}

RadiographSettings settings_of(const RadiographArguments& arguments) {
  RadiographSettings settings;
  settings.detector.quanta_per_pixel =
      arguments.dose_quanta > 0 ? arguments.dose_quanta : std::numeric_limits<double>::infinity();
  if (arguments.dose_quanta <= 0) {
    settings.detector.electronic_noise = 0;
  }
  settings.display.bits = arguments.bits;
  if (arguments.has_console) {
    settings.console = typical_console();
  }
  add_default_clutter(settings);
  add_surgery(settings);
  add_lumen(settings, mean_aorta());
  if (wants(arguments, "heart")) {
    settings.motion.heart_phases = 4;
  }
  if (wants(arguments, "breathing")) {
    settings.motion.breathing_phases = 8;
  }
  return settings;
}

RadiographScene scene_of(const RadiographArguments& arguments, int frame) {
  RadiographScene scene;
  scene.exposure = frame;
  scene.time_s = arguments.start_s + frame / arguments.rate_hz;
  if (!arguments.bare) {
    scene.catheters.push_back(catheter_along(mean_aorta(), arguments.catheter_from_valve_mm));
  }
  scene.clutter.second_wire = wants(arguments, "wire");
  scene.clutter.ecg_leads = wants(arguments, "leads");
  scene.clutter.surgery = wants(arguments, "surgery");
  scene.clutter.collimator = wants(arguments, "collimator");
  scene.clutter.heart_beat = wants(arguments, "heart");
  scene.clutter.breathing = wants(arguments, "breathing");
  scene.clutter.contrast_age_s = wants(arguments, "contrast") ? scene.time_s : -1;
  return scene;
}

/// The file asked for; with several views or frames their letter and number stand before its ending.
std::string file_of(const RadiographArguments& arguments, std::size_t view, int frame) {
  const std::filesystem::path out(arguments.out);
  std::string name = out.stem().string();
  if (arguments.lao_deg.size() > 1) {
    name += std::string("-") + static_cast<char>('A' + view);
  }
  if (arguments.frames > 1) {
    const std::string number = std::to_string(frame);
    name += "-" + std::string(number.size() < 4 ? 4 - number.size() : 0, '0') + number;
  }
  return (out.parent_path() / (name + out.extension().string())).string();
}

void draw_view(const RadiographArguments& arguments, const AttenuationVolume& patient, std::size_t view) {
  const CArmAngles angles{arguments.lao_deg[view], arguments.cranial_deg};
  const Eigen::Vector3d target =
      arguments.ct_folder.empty()
          ? Eigen::Vector3d(arguments.target_mm[0], arguments.target_mm[1], arguments.target_mm[2])
          : patient.centre_room_mm();
  const CameraCalibration camera = c_arm_view(std::string(1, static_cast<char>('A' + view)), angles, target);
  Radiograph radiograph(camera, patient, settings_of(arguments), arguments.seed);
  std::vector<std::uint8_t> pixels(radiograph.bytes_per_image());
  const PixelLayout layout = arguments.bits == 8 ? PixelLayout::kGrey8 : PixelLayout::kGrey16;
  for (int frame = 0; frame < arguments.frames; ++frame) {
    radiograph.render(scene_of(arguments, frame), pixels);
    const std::string file = file_of(arguments, view, frame);
    write_picture(file, {camera.width, camera.height, layout, pixels});
    std::cout << file << '\n';
  }
}

void run_radiograph(const RadiographArguments& arguments) {
  if (std::filesystem::path(arguments.out).extension() != ".png") {
    throw std::invalid_argument("--out " + arguments.out + ": has to end in .png");
  }
  const AttenuationVolume patient = patient_of(arguments);
  for (std::size_t view = 0; view < arguments.lao_deg.size(); ++view) {
    draw_view(arguments, patient, view);
  }
}

}  // namespace

CommandLine add_radiograph(CommandLine app, int& exit_code) {
  CommandLine verb = app.add_subcommand("radiograph", "Write pictures of the simulated fluoroscope (PNG)");
  const auto arguments = std::make_shared<RadiographArguments>();
  verb.add_option("--out", arguments->out, "File; several views or frames get a letter or number")
      .capture_default_str();
  verb.add_option("--lao", arguments->lao_deg, "C-arm angle, deg; negative: RAO; two for two views")
      .expected(1, 2)
      .in_range(-180.0, 180.0)
      .capture_default_str();
  verb.add_option("--cranial", arguments->cranial_deg, "C-arm angle, deg; negative: caudal")
      .in_range(-80.0, 80.0)
      .capture_default_str();
  verb.add_option("--target", arguments->target_mm,
                  "What is in the middle: mm left, posterior, superior of the arch")
      .expected(3, 3)
      .capture_default_str();
  verb.add_option("--dose", arguments->dose_quanta, "Quanta in the median pixel; 0: no noise")
      .in_range(0.0, 1e7)
      .capture_default_str();
  verb.add_option("--bits", arguments->bits, "8 or 16").is_member({"8", "16"}).capture_default_str();
  verb.add_option("--clutter", arguments->clutter,
                  "Any of wire, leads, surgery, contrast, collimator, heart, breathing")
      .delimiter(',')
      .is_member({"wire", "leads", "surgery", "contrast", "collimator", "heart", "breathing"});
  verb.add_option("--frames", arguments->frames, "Exposures").in_range(1, 10000).capture_default_str();
  verb.add_option("--rate", arguments->rate_hz, "Exposures a second")
      .in_range(0.1, 1000.0)
      .capture_default_str();
  verb.add_option("--time", arguments->start_s, "Of the first exposure, s; contrast agent is injected at 0")
      .capture_default_str();
  verb.add_option("--from-valve", arguments->catheter_from_valve_mm, "Of the catheter's tip, mm")
      .in_range(0.0, 350.0)
      .capture_default_str();
  verb.add_flag("--console", arguments->has_console,
                "As a console's video output shows it: grid, vignetting, edge enhancement, text, ...");
  verb.add_flag("--no-catheter", arguments->bare, "The patient alone");
  verb.add_option("--ct", arguments->ct_folder, "Folder with one CT series (DICOM) to take as patient");
  verb.add_option("--voxel", arguments->voxel_mm, "Voxels of the built-in patient, mm")
      .in_range(0.5, 5.0)
      .capture_default_str();
  verb.add_option("--seed", arguments->seed, "Of noise, texture and lung vessels").capture_default_str();
  verb.callback([arguments, &exit_code] {
    run_radiograph(*arguments);
    exit_code = kExitOk;
  });
  return verb;
}

}  // namespace tubed
