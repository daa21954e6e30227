// tubectl calibrate tip: the rest shape of a tip, from a drawing.
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "clients/calibration/traced_tip.hpp"
#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/calibrate/bad_data.hpp"
#include "clients/tubectl/calibrate/calibrate_coils.hpp"
#include "clients/tubectl/verbs.hpp"

namespace tubed {

namespace {

struct TipOptions {
  std::string drawing;
  double mm_per_px = 0;
  std::string instrument = "cath-1";
  std::string json;
  AcceptOptions accept;
};

int calibrate_tip(const TipOptions& options) {
  const TracedTip drawing = read_traced_tip(options.drawing, options.mm_per_px);
  const TracedCurve found = fit_arcs(drawing);
  const ConfigurationFragment fragment = fragment_of(found, drawing, options.instrument);
  write_report(page_of(found, drawing, fragment), options.accept);
  for (const std::string& doubt : doubts_of(found)) std::cerr << "tubectl: WARNING: " << doubt << '\n';
  if (options.json == "-") {
    nlohmann::json arcs = nlohmann::json::array();
    for (const RestArc& arc : found.curve.arcs) {
      arcs.push_back({{"length_mm", arc.length_mm}, {"radius_mm", arc.radius_mm}});
    }
    std::cout << nlohmann::json{{"arcs", std::move(arcs)},
                                {"rms_mm", found.rms_mm},
                                {"max_mm", found.max_mm},
                                {"drawn_mm", found.drawn_mm},
                                {"ends_bent", found.ends_bent}}
                     .dump(2)
              << '\n';
    return offer_beside_json(fragment, options.accept);
  }
  return offer(fragment, options.accept);
}

}  // namespace

CommandLine add_calibrate_tip(CommandLine app, int& exit_code) {
  const auto options = std::make_shared<TipOptions>();
  CommandLine verb = app.add_subcommand(
      "tip", "Rest shape of a pre-shaped tip, from points drawn along its middle while nothing bends it");
  verb.add_option("DRAWING", options->drawing,
                  "Points, the tip first, every 2 or 3 mm (CSV with x_mm,y_mm, or x_px,y_px of a photograph)")
      .required();
  verb.add_option("--mm-per-px", options->mm_per_px,
                  "Size of a photograph's pixel; the columns are x_px,y_px")
      .in_range(1e-4, 10.0);
  verb.add_option("--instrument", options->instrument, "Whose tip it is, its id in the configuration")
      .capture_default_str();
  verb.add_option("--json", options->json, "- for the arcs as JSON on standard output").is_member({"-"});
  add_accept_options(verb, options->accept);
  verb.footer("Example:\n  tubectl calibrate tip jl4.csv --report jl4.svg --config /etc/tubed/tubed.toml");
  verb.callback(
      [options, &exit_code] { exit_code = saying_bad_data([&] { return calibrate_tip(*options); }); });
  return verb;
}

}  // namespace tubed
