#include "drivers/simulation/simulation_driver.hpp"

#include <limits>

#include "drivers/laboratory/simulated_world.hpp"
#include "drivers/simulation/simulated_em_source.hpp"
#include "drivers/simulation/simulated_image_source.hpp"

namespace tubed {

namespace {

/// What is simulated, and how it is measured.
std::vector<KeyDescription> scene_settings() {
  constexpr double kNoLimit = std::numeric_limits<double>::infinity();
  return {
      key::word("preset", std::string(kArchPreset), simulation_presets(),
                "what is simulated; all but arch push a catheter through an aorta, set the tracker's errors "
                "themselves and take some seconds to start"),
      key::integer("seed", 1, "", {0, 1e15},
                   "of noise and background, and of the patient in a preset; in the arch the catheters move "
                   "the same for all"),
      key::text("vessel", "", {},
                "file of a vessel of your own for a preset, .csv or .stl, in mm; empty = the preset's aorta"),
      key::real(
          "hook_radius_mm", 0.0, "mm", {0, 100},
          "in a preset the catheter's tip is a hook of this radius, 6 or more; 0 = as the preset has it"),
      key::real("hook_length_mm", 0.0, "mm", {0, 45},
                "length of the hook; 0 = 1.75 times its radius, 14 at least and 40 at most"),
      {.name = "hook_arcs_mm",
       .default_value = std::vector<double>{},
       .unit = "mm",
       .minimum = -500,
       .maximum = 500,
       .maximum_count = 2 * kMaxRestArcs,
       .meaning = "instead of both: length and radius of each arc of the hook, one after the other, as "
                  "rest_arcs_mm of an instrument; 45 mm at most, radii of 6 or more"},
      key::real(
          "tip_stiffness", 0.0, "", {0, 5},
          "in a preset the catheter's last 50 mm are so many times as stiff as its shaft, 0.05 or more; "
          "0 = as the preset has it, half as stiff"),
      key::text(
          "panel", "", {},
          "what takes a preset's pictures: readout, bits and a pixel's mm where the patient is, such as "
          "\"linear,12,0.2\"; empty = as the preset has it"),
      key::boolean(
          "undisturbed", false,
          "a preset's pictures come straight from the detector, without what a console does to them, "
          "and without marker bands, braid, wires and leads"),
      key::integer("epoch_ns", 0, "ns", {0, kNoLimit}, "CLOCK_MONOTONIC at which the motion begins"),
      key::real("em_rate_hz", 40.0, "Hz", {1, 1000}, "measurements of the tracker"),
      key::real("lambda_mm", 4.0, "mm", {0, 100}, "amplitude of the position noise, Eq. (19)"),
      key::real("psi_deg", 3.0, "deg", {0, 180}, "angle of the tangent noise, Eq. (20)"),
      key::real("em_latency_ms", 12.0, "ms", {0, 10000}, "from measurement to delivery"),
      key::real("frame_rate_hz", 30.0, "Hz", {0.1, 200}, "exposures of each fluoroscope"),
      key::real("image_latency_ms", 8.0, "ms", {0, 10000}, "from exposure to delivery"),
      key::real("cnr", 2.7, "", {0.1, 1e6}, "contrast of the catheter to the noise of one pixel"),
      key::real("speed_mm_s", 20.0, "mm/s", {0, 500}, "greatest speed of the catheters along the vessel")};
}

/// What of the room moves, and what is wrong with it.
std::vector<KeyDescription> room_settings() {
  return {
      key::real(
          "swing_deg", 0.0, "deg", {-120, 120},
          "the C-arm of the first view swings by so much, LAO and RAO, and back; 0 = it stands, or does "
          "what the preset has it do"),
      key::real("swing_every_s", 20.0, "s", {0.2, 3600}, "it swings there and back once in so long"),
      key::real("swing_deg_s", 10.0, "deg/s", {0.1, 120}, "its speed"),
      key::boolean("announces_pose", true,
                   "each image of a view that moves says how the view stood; false: nothing says so"),
      key::real("generator_shift_mm", 0.0, "mm", {0, 1000},
                "the field generator is pushed by so much; 0 = it stays"),
      key::real("generator_turn_deg", 0.0, "deg", {-180, 180}, "and turned by so much about itself"),
      key::real("generator_moves_at_s", 5.0, "s", {0, 1e6}, "when it is pushed, s after the epoch"),
      key::real("generator_push_s", 0.3, "s", {0, 3600}, "how long the push takes"),
      key::real("generator_drift_mm_s", 0.0, "mm/s", {-100, 100}, "it also drifts, from the epoch on"),
      key::real("pose_noise_deg", 0.1, "deg", {0, 10},
                "standard deviation of what it says then of the C-arm's angles"),
      key::real("pose_noise_mm", 1.0, "mm", {0, 100}, ".. of where it stands"),
      key::real(
          "pan_mm", 0.0, "mm", {-200, 200},
          "the table pans by so much, once, at 10 mm/s in the plane of the first view's image, and stays"),
      key::real("turn_deg", 0.0, "deg", {-120, 120},
                "the C-arm of the first view turns by so much, once, at 10 deg/s, and stays"),
      key::real("zoom", 1.0, "", {0.5, 2},
                "the focal lengths of the first view become so many times what they were, once"),
      key::real(
          "move_at_s", -1.0, "s", {-1, 1e6},
          "when these three begin; negative = half way through the preset's commands, in the arch at 30 s"),
      key::text(
          "mistakes", "", {},
          "what is wrong with the room or with what this file says of it, as words between blanks, such as "
          "\"registration=6,2 clock=150\": the list of `tubectl simulate --help`; empty = nothing"),
      key::text("control_folder", "", {}, "where sockets for faults on request are bound; empty = none")};
}

}  // namespace

std::vector<KeyDescription> simulation_settings() {
  std::vector<KeyDescription> all = scene_settings();
  const std::vector<KeyDescription> of_room = room_settings();
  all.insert(all.end(), of_room.begin(), of_room.end());
  return all;
}

DriverDescription simulation_driver() {
  const auto settings = [](const SourceContext& context) {
    return context.settings_with_paths({"control_folder", "vessel"});
  };
  DriverDescription driver{"simulation",
                           "a catheter in an aortic arch, without any hardware",
                           Origin::kSimulated,
                           simulation_settings(),
                           [settings](const SourceContext& context) {
                             return make_simulation_em_source(context.room, settings(context));
                           },
                           [settings](const SourceContext& context, int camera_index) {
                             return make_simulation_image_source(context.room, settings(context),
                                                                 camera_index);
                           }};
  driver.gives_orientation = true;
  return driver;
}

std::unique_ptr<EmSource> make_simulation_em_source(const RoomDescription& room,
                                                    const DriverSettings& settings) {
  return std::make_unique<SimulatedEmSource>(room, settings);
}

std::unique_ptr<ImageSource> make_simulation_image_source(const RoomDescription& room,
                                                          const DriverSettings& settings, int camera_index) {
  return std::make_unique<SimulatedImageSource>(room, settings, camera_index);
}

}  // namespace tubed
