// tubectl calibrate: cameras, coils, the tracker's noise, the clock of images.
#include "clients/tubectl/calibrate/calibrate_camera.hpp"
#include "clients/tubectl/calibrate/calibrate_coils.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

CommandLine add_calibrate(CommandLine app, int& exit_code) {
  CommandLine verb = app.add_subcommand("calibrate",
                                        "Calibrate cameras, coils, a tip's rest shape, the tracker's noise, "
                                        "the clock of images, the registration and views that moved");
  verb.require_subcommand();
  add_calibrate_camera(verb, exit_code);
  add_calibrate_phantom(verb, exit_code);
  add_calibrate_coils(verb, exit_code);
  add_calibrate_arc_lengths(verb, exit_code);
  add_calibrate_tip(verb, exit_code);
  add_calibrate_noise(verb, exit_code);
  add_calibrate_time(verb, exit_code);
  add_calibrate_registration(verb, exit_code);
  add_calibrate_view(verb, exit_code);
  return verb;
}

}  // namespace tubed
