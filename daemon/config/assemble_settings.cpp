#include <algorithm>
#include <string>

#include "daemon/config/assemble.hpp"

namespace tubed {

namespace {

int as_int(std::int64_t value) { return static_cast<int>(value); }

ThreadSettings thread_settings(const CheckedTable& stage) {
  ThreadSettings settings;
  settings.fifo_priority = as_int(stage.get<std::int64_t>("priority"));
  for (const std::int64_t cpu : stage.get<std::vector<std::int64_t>>("cpus")) {
    settings.cpus.push_back(as_int(cpu));
  }
  return settings;
}

void check_grace(const CheckedTable& daemon, const PipelineSettings& settings, Problems& problems) {
  const double period_ms = 1000 / settings.rate_hz;
  if (daemon.sound("rate_hz") && daemon.sound("tick_grace_ms") && settings.tick_grace_ms >= period_ms) {
    problems.push_back({daemon.at("tick_grace_ms").position, "daemon.tick_grace_ms",
                        "expected less than the period of daemon.rate_hz, " + std::to_string(period_ms) +
                            " ms, found " + to_toml(settings.tick_grace_ms)});
  }
}

void check_back_off(const CheckedTable& em, const PipelineSettings& settings, Problems& problems) {
  if (em.sound("reconnect_first_ms") && em.sound("reconnect_last_ms") &&
      settings.reconnect_last_ms < settings.reconnect_first_ms) {
    problems.push_back({em.at("reconnect_last_ms").position, "em.reconnect_last_ms",
                        "expected at least em.reconnect_first_ms, " + to_toml(settings.reconnect_first_ms) +
                            " ms, found " + to_toml(settings.reconnect_last_ms)});
  }
}

EstimatorMode mode_of(const std::string& word) { return mode_named(word).value_or(EstimatorMode::kFilter); }

// Images are half of these modes: without a camera they would be EM alone under another name. The filter goes
// on with coils alone.
void check_mode(const CheckedTable& file, const CheckedTable& decides, EstimatorMode mode,
                Problems& problems) {
  const bool needs_camera = mode == EstimatorMode::kJoint || mode == EstimatorMode::kPaper;
  if (needs_camera && file.many("camera").empty() && decides.sound("mode")) {
    problems.push_back({decides.at("mode").position, decides.path_of("mode"),
                        "\"" + std::string(name_of(mode)) +
                            "\" needs at least one [[camera]]; use \"em\" or \"filter\" without"});
  }
}

PaperSettings paper_settings(const CheckedTable& paper) {
  const auto says = [&](const char* key, std::string_view word) {
    return paper.get<std::string>(key) == word;
  };
  PaperSettings settings;
  settings.knot_point_count = as_int(paper.get<std::int64_t>("knot_point_count"));
  settings.weights = says("weights", "printed") ? PaperWeights::kPrinted : PaperWeights::kConsistent;
  settings.sigma_length_mm = paper.get<double>("sigma_length_mm");
  settings.depth_lengths =
      says("depth_lengths", "printed") ? PaperDepthLengths::kPrinted : PaperDepthLengths::kLeftOut;
  settings.mle_start = says("mle_start", "em") ? PaperMleStart::kEm : PaperMleStart::kLines;
  settings.mle_prior = says("mle_prior", "none") ? PaperMlePrior::kNone : PaperMlePrior::kEmError;
  settings.hub_end = says("hub_end", "capped") ? PaperHubEnd::kCapped : PaperHubEnd::kGoesOn;
  settings.heaviside = says("heaviside", "fixed") ? PaperHeaviside::kFixed : PaperHeaviside::kNarrowing;
  settings.heaviside_px = paper.get<double>("heaviside_px");
  settings.appearance_share = paper.get<double>("appearance_share");
  settings.rounds = as_int(paper.get<std::int64_t>("rounds"));
  return settings;
}

}  // namespace

PipelineSettings pipeline_settings(const CheckedTable& file, Problems& problems) {
  const CheckedTable& daemon = file.one("daemon");
  const CheckedTable& realtime = file.one("realtime");
  const CheckedTable& em = file.one("em");
  PipelineSettings settings;
  settings.rate_hz = daemon.get<double>("rate_hz");
  settings.tick_grace_ms = daemon.get<double>("tick_grace_ms");
  settings.reconnect_first_ms = em.get<double>("reconnect_first_ms");
  settings.reconnect_last_ms = em.get<double>("reconnect_last_ms");
  settings.image_stale_ms = file.one("estimator").get<double>("image_stale_ms");
  settings.em_stale_ms = file.one("estimator").get<double>("em_stale_ms");
  settings.scheduling_optional = realtime.get<std::string>("scheduling") == "optional";
  settings.em_acquisition = thread_settings(realtime.one("em_acquisition"));
  settings.image_grab = thread_settings(realtime.one("image_grab"));
  settings.frangi = thread_settings(realtime.one("frangi"));
  settings.optimizer = thread_settings(realtime.one("optimizer"));
  settings.publisher = thread_settings(realtime.one("publisher"));
  check_grace(daemon, settings, problems);
  check_back_off(em, settings, problems);
  return settings;
}

DdsSettings dds_settings(const CheckedTable& file) {
  const CheckedTable& dds = file.one("dds");
  DdsSettings settings;
  settings.domain = as_int(dds.get<std::int64_t>("domain"));
  settings.partition = dds.get<std::string>("partition");
  settings.network_interface = dds.get<std::string>("network_interface");
  settings.world_frame = dds.get<std::string>("world_frame");
  settings.world_axes = dds.get<std::string>("world_axes");
  return settings;
}

ShmSettings shm_settings(const CheckedTable& file, const std::filesystem::path& folder) {
  const CheckedTable& shm = file.one("shm");
  ShmSettings settings;
  const std::filesystem::path socket = shm.get<std::string>("estimates_socket");
  settings.estimates_socket = socket.empty() ? "" : (folder / socket).lexically_normal().string();
  settings.group = shm.get<std::string>("group");
  return settings;
}

FrangiSettings frangi_settings(const CheckedTable& file) {
  const CheckedTable& frangi = file.one("frangi");
  FrangiSettings settings;
  settings.scales_px = frangi.get<std::vector<double>>("scales_px");
  settings.beta = frangi.get<double>("beta");
  settings.structureness = frangi.get<double>("structureness");
  settings.polarity =
      frangi.get<std::string>("polarity") == "bright" ? RidgePolarity::kBright : RidgePolarity::kDark;
  settings.smoothing = frangi.get<std::string>("smoothing") == "integer16" ? FrangiSmoothing::kInteger16
                                                                           : FrangiSmoothing::kFloat;
  settings.area = frangi.get<std::string>("area") == "frame" ? FrangiArea::kFrame : FrangiArea::kBand;
  return settings;
}

std::vector<EstimatorSettings> estimator_settings(const CheckedTable& file, Problems& problems) {
  const CheckedTable& table = file.one("estimator");
  EstimatorSettings defaults;
  defaults.coefficient_count = as_int(table.get<std::int64_t>("coefficient_count"));
  defaults.sigma_position_mm = table.get<double>("sigma_position_mm");
  defaults.sigma_tangent = table.get<double>("sigma_tangent");
  defaults.sigma_strain_sqrt_mm = table.get<double>("sigma_strain_sqrt_mm");
  defaults.bending_q_per_mm = table.get<double>("bending_q_per_mm");
  defaults.image_likelihood =
      image_likelihood_named(table.get<std::string>("image_likelihood")).value_or(defaults.image_likelihood);
  defaults.sigma_image_px = table.get<double>("sigma_image_px");
  defaults.image_search_px = table.get<double>("image_search_px");
  defaults.image_temper = table.get<double>("image_temper");
  defaults.em_stale_ms = table.get<double>("em_stale_ms");
  defaults.em_stuck_ms = table.get<double>("em_stuck_ms");
  defaults.iterations = as_int(table.get<std::int64_t>("iterations"));
  defaults.paper = paper_settings(table.one("paper"));
  std::vector<EstimatorSettings> estimators;
  bool common_mode_used = false;
  for (const CheckedTable& instrument : file.many("instrument")) {
    const bool own_mode = instrument.has("mode");
    EstimatorSettings settings = defaults;
    settings.mode = mode_of((own_mode ? instrument : table).get<std::string>("mode"));
    if (own_mode || !common_mode_used) {
      check_mode(file, own_mode ? instrument : table, settings.mode, problems);
    }
    common_mode_used = common_mode_used || !own_mode;
    estimators.push_back(settings);
  }
  return estimators;
}

}  // namespace tubed
