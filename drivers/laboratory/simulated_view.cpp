#include "drivers/laboratory/simulated_view.hpp"

#include <algorithm>

#include "drivers/laboratory/fluoroscope/clutter.hpp"
#include "drivers/laboratory/fluoroscope/mock_up.hpp"
#include "drivers/laboratory/fluoroscope/thorax.hpp"
#include "drivers/laboratory/vessel/vessel_file.hpp"

namespace tubed {

namespace {

constexpr double kRodStep_mm = 2;
constexpr double kGold_per_mm = 7;  ///< at about 65 keV
constexpr double kSteel_per_mm = 0.6;
constexpr Eigen::Index kRodPoints = 380;  ///< the whole catheter in the patient, and beyond

/// The route of the scenario's vessel, from the introducer to the valve.
VesselCourse course_of(const Scenario& scenario) {
  const Vessel vessel =
      scenario.vessel_file.empty() ? make_aorta(scenario.patient) : read_vessel(scenario.vessel_file);
  const auto count = static_cast<Eigen::Index>(vessel.route.size());
  VesselCourse course{Eigen::Matrix3Xd(3, count), Eigen::VectorXd(count)};
  for (Eigen::Index i = 0; i < count; ++i) {
    const VesselStation& station = vessel.route[static_cast<std::size_t>(i)];
    course.centreline_room_mm.col(i) = station.p_world_mm;
    course.radius_mm[i] = station.radius_mm;
  }
  return course;
}

/// Tip electrode and three rings, as of an ablation catheter.
std::vector<RadiographElectrode> electrodes() {
  std::vector<RadiographElectrode> all;
  const auto add = [&all](double s_mm, double length_mm) {
    RadiographElectrode electrode;
    electrode.s_mm = s_mm;
    electrode.length_mm = length_mm;
    all.push_back(electrode);
  };
  add(1.75, 3.5);
  for (const double s_mm : ring_electrodes_mm()) add(s_mm, kRingElectrode_mm);
  return all;
}

/// What of the wall is metal: bands of gold, and the wire of a braid. Its crossings are finer than any pixel
/// here; what is seen of them is a period along the catheter, as rings of flat wire give it.
void add_metal(const Scenario& scenario, double length_mm, std::vector<RadiographElectrode>& rings) {
  for (const double s_mm : scenario.marker_bands_mm) {
    rings.push_back({.s_mm = s_mm, .length_mm = 1.5, .wall_mm = 0.06, .attenuation_per_mm = kGold_per_mm});
  }
  constexpr double kBraidPeriod_mm = 1.7;
  constexpr double kTipWithout_mm = 18;  // a braid ends before the soft tip
  for (double s_mm = kTipWithout_mm; scenario.is_braided && s_mm < length_mm; s_mm += kBraidPeriod_mm) {
    rings.push_back({.s_mm = s_mm, .length_mm = 0.6, .wall_mm = 0.05, .attenuation_per_mm = kSteel_per_mm});
  }
}

RadiographRod rod_of(const InstrumentDescription& instrument, const Scenario& scenario) {
  RadiographRod rod;
  rod.centreline_room_mm.resize(3, kRodPoints);
  rod.radius_mm = instrument.diameter_mm / 2;
  rod.lumen_radius_mm = std::min(rod.lumen_radius_mm, rod.radius_mm / 2);
  rod.electrodes = electrodes();
  add_metal(scenario, instrument.length_mm, rod.electrodes);
  for (RadiographElectrode& electrode : rod.electrodes) {
    electrode.radius_mm = rod.radius_mm;
  }
  return rod;
}

RadiographSettings settings_of(const Scenario& scenario, const RoomMistakes& mistakes) {
  RadiographSettings settings;
  settings.detector.lag = scenario.detector_lag;
  settings.console = scenario.console;
  if (mistakes.averaging > 0) {
    settings.console.recursive_share = mistakes.averaging;
    settings.console.recursive_limit = mistakes.averaging_limit;
  }
  const ClutterStates& clutter = scenario.clutter;
  if (clutter.heart_beat || clutter.breathing) {
    add_motion(settings);
  }
  if (scenario.contrast_from_s >= 0) {
    add_lumen(settings, course_of(scenario));
  }
  if (clutter.second_wire || clutter.ecg_leads) {
    add_default_clutter(settings);
  }
  if (clutter.surgery) {
    add_surgery(settings);
  }
  return scenario.panel ? with_panel(std::move(settings), *scenario.panel) : settings;
}

}  // namespace

std::vector<double> ring_electrodes_mm() { return {6.5, 10.5, 14.5}; }

AttenuationVolume body_of(const SimulatedWorld& world) {
  const Scenario& scenario = *world.scenario();
  if (scenario.body == Body::kMockUp) return make_mock_up(course_of(scenario));
  ThoraxSettings settings;
  settings.seed = scenario.seed;
  settings.aorta = course_of(scenario);
  return make_thorax(settings);
}

SimulatedView::SimulatedView(const CameraCalibration& camera, const SimulatedWorld& world, std::int64_t seed,
                             double cnr, std::shared_ptr<const AttenuationVolume> body, PanOnRequest pan)
    : at_rest_(camera), view_(geometry_of(camera)), seed_(seed) {
  const Scenario* scenario = world.scenario();
  if (scenario == nullptr) {
    drawn_ = std::make_unique<FluoroscopeRenderer>(camera, world, seed, cnr);
    return;
  }
  if (body == nullptr) {
    body = std::make_shared<const AttenuationVolume>(body_of(world));
  }
  settings_ = std::make_unique<const RadiographSettings>(settings_of(*scenario, world.mistakes()));
  radiograph_ = std::make_unique<Radiograph>(camera, *body, *settings_, seed);
  if (world.view_motion().moves_at_all() || pan == PanOnRequest::kYes) {
    body_ = std::move(body);
  }
  full_grey_ = (1 << settings_->display.bits) - 1;
  scene_.clutter = scenario->clutter;
  const auto& instruments = world.room().instruments;
  for (std::size_t i = 0; i < instruments.size(); ++i) {
    if (world.catheter_of(static_cast<int>(i)) == static_cast<int>(i)) {
      scene_.catheters.push_back(rod_of(instruments[i], *scenario));
    }
  }
  if (scenario->has_twin) {
    scene_.catheters.push_back(scene_.catheters.front());
  }
}

void SimulatedView::look_from(const ViewGeometry& view) {
  if (view == view_) {
    return;
  }
  view_ = view;
  if (drawn_ != nullptr) {
    drawn_->look_from(view);
    return;
  }
  CameraCalibration moved = at_rest_;
  moved.look_from(view);
  radiograph_ = std::make_unique<Radiograph>(moved, *body_, *settings_, seed_);
}

void SimulatedView::place_catheters(const SimulatedWorld& world, double t_s) {
  std::size_t rod = 0;
  const auto place = [&](const auto& point) {
    Eigen::Matrix3Xd& points = scene_.catheters[rod++].centreline_room_mm;
    for (Eigen::Index i = 0; i < points.cols(); ++i) {
      points.col(i) = point(kRodStep_mm * static_cast<double>(i));
    }
  };
  for (int instrument = 0; instrument < static_cast<int>(world.room().instruments.size()); ++instrument) {
    if (world.catheter_of(instrument) == instrument) {
      place([&](double s_mm) { return world.point(instrument, t_s, s_mm); });
    }
  }
  if (world.scenario()->has_twin) {
    place([&](double s_mm) { return world.twin_point(t_s, s_mm); });
  }
}

void SimulatedView::render(const SimulatedWorld& world, double t_s, std::int64_t exposure,
                           std::span<std::uint8_t> pixels) {
  look_from(panned_view(world.view(at_rest_, t_s), pan_mm_));
  if (drawn_ != nullptr) {
    drawn_->render(world, t_s, exposure, pixels);
    spoil(world.mistakes(), pixels);
    return;
  }
  const double scenario_s = world.scenario_time_s(t_s);
  const double contrast_from_s = world.scenario()->contrast_from_s;
  scene_.exposure = exposure;
  scene_.time_s = t_s;
  scene_.clutter.contrast_age_s = contrast_from_s >= 0 ? scenario_s - contrast_from_s : -1;
  place_catheters(world, t_s);
  radiograph_->render(scene_, pixels);
  if (depth() == PixelDepth::kGrey16) {
    spoil(world.mistakes(),
          std::span(reinterpret_cast<std::uint16_t*>(pixels.data()), pixels.size() / sizeof(std::uint16_t)));
  } else {
    spoil(world.mistakes(), pixels);
  }
}

std::size_t SimulatedView::bytes_per_image() const {
  return static_cast<std::size_t>(at_rest_.width) * static_cast<std::size_t>(at_rest_.height) *
         (depth() == PixelDepth::kGrey16 ? 2 : 1);
}

template <typename Pixel>
void SimulatedView::spoil(const RoomMistakes& mistakes, std::span<Pixel> pixels) const {
  if (mistakes.inverts) {
    for (Pixel& pixel : pixels) pixel = static_cast<Pixel>(full_grey_ - pixel);
  }
  if (mistakes.mirrors) {
    const auto width = static_cast<std::ptrdiff_t>(at_rest_.width);
    for (auto row = pixels.begin(); row != pixels.end(); row += width) std::reverse(row, row + width);
  }
}

}  // namespace tubed
