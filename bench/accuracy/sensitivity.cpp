#include "bench/accuracy/sensitivity.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>

#include "bench/accuracy/disturbances.hpp"
#include "clients/evaluation/statistics.hpp"

namespace tubed {

namespace {

constexpr double kTangentBase_mm = 1.0;  // half the chord that gives a coil's direction
constexpr double kAngleOfLambda =
    0.0523598776 / 4;  // rad per mm: noise grows as in the paper, 3 deg with 4 mm

/// Truth at s, linear between its millimetres; continued straight beyond its ends.
Eigen::Vector3d true_point(const Eigen::Matrix3Xd& truth_mm, double s_mm) {
  const double place = std::clamp(s_mm, 0.0, static_cast<double>(truth_mm.cols() - 1));
  const auto before = std::min(static_cast<Eigen::Index>(place), truth_mm.cols() - 2);
  const double t = s_mm - static_cast<double>(before);
  return (1 - t) * truth_mm.col(before) + t * truth_mm.col(before + 1);
}

CoilSample measured(const Eigen::Matrix3Xd& truth_mm, double s_mm, const CoilStudy& study,
                    const RigidTransform& T_em_world, std::mt19937_64& random) {
  const Eigen::Vector3d tangent =
      (true_point(truth_mm, s_mm - kTangentBase_mm) - true_point(truth_mm, s_mm + kTangentBase_mm))
          .normalized();
  const Eigen::Vector3d across = tangent.cross(random_direction(random)).normalized();
  CoilSample sample;
  sample.status = CoilStatus::kOk;
  sample.p_em_mm =
      T_em_world * (true_point(truth_mm, s_mm) + study.lambda_mm * random_direction(random)).eval();
  sample.tangent_em = T_em_world.linear() * (Eigen::AngleAxisd(study.psi_rad, across) * tangent);
  return sample;
}

std::vector<double> evenly(std::size_t coils) {
  std::vector<double> offsets_mm;
  for (std::size_t i = 0; i < coils; ++i) {
    offsets_mm.push_back(10 + 360 * static_cast<double>(i) / static_cast<double>(coils - 1));
  }
  return offsets_mm;
}

/// One value of one study.
struct Variant {
  double value;
  Sequence sequence;
  std::function<void(EstimatorSettings&)> change = [](EstimatorSettings&) {};
  JudgedInstants judged = [](const SequenceInstant&) { return true; };
};

struct Study {
  std::string varied;
  std::vector<Variant> variants;
};

void expect_noise(EstimatorSettings& settings, double lambda_mm, double psi_rad) {
  settings.sigma_position_mm = std::max(lambda_mm / std::sqrt(3.0), 0.05);
  settings.sigma_tangent = std::max(psi_rad / std::sqrt(3.0), 0.002);
}

Study coil_study(const Sequence& sequence) {
  Study study{"number of coils", {}};
  for (const std::size_t coils : {3, 4, 5, 7, 10}) {
    CoilStudy coil;
    coil.offsets_mm = evenly(coils);
    study.variants.push_back({static_cast<double>(coils), measured_again(sequence, coil)});
  }
  return study;
}

Study noise_study(const Sequence& sequence) {
  Study study{"noise amplitude, mm (3 deg with 4 mm)", {}};
  for (const double lambda_mm : {0.5, 1.0, 2.0, 4.0, 6.0, 8.0}) {
    CoilStudy coil;
    coil.lambda_mm = lambda_mm;
    coil.psi_rad = lambda_mm * kAngleOfLambda;
    study.variants.push_back({lambda_mm, measured_again(sequence, coil), [=](EstimatorSettings& settings) {
                                expect_noise(settings, lambda_mm, coil.psi_rad);
                              }});
  }
  return study;
}

Study registration_study(const Sequence& sequence) {
  Study study{"registration error, mm", {}};
  for (const double error_mm : {0.0, 1.0, 2.0, 4.0}) {
    study.variants.push_back({error_mm, misregistered(measured_again(sequence, {}), error_mm, 1)});
  }
  return study;
}

Study rate_study(const Sequence& sequence) {
  Study study{"instants left out between two", {}};
  for (const std::size_t step : {1, 2, 4, 8}) {
    study.variants.push_back({static_cast<double>(step - 1), thinned(measured_again(sequence, {}), step)});
  }
  return study;
}

Study second_view_study(const Sequence& sequence) {
  Study study{"second view in one of so many of its instants (0: never)", {}};
  for (const std::size_t step : {0, 1, 2, 4}) {
    study.variants.push_back(
        {static_cast<double>(step), with_second_view_every(measured_again(sequence, {}), step)});
  }
  return study;
}

Study coefficient_study(const Sequence& sequence) {
  Study study{"coefficients (paper: knot points)", {}};
  for (const int count : {12, 16, 20, 26, 33, 40}) {
    study.variants.push_back(
        {static_cast<double>(count), measured_again(sequence, {}), [=](EstimatorSettings& settings) {
           settings.coefficient_count = count;
           settings.paper.knot_point_count = count;
         }});
  }
  return study;
}

/// Fluoroscopy off for a part of every four seconds; only the instants without image are judged, but for 0,
/// where all are.
Study fluoroscopy_study(const Sequence& sequence) {
  constexpr double kPeriod_s = 4;
  Study study{"s of every 4 without fluoroscopy (judged: these)", {}};
  const double start_s = sequence.frames.empty() ? 0 : sequence.frames.front().t_s;
  for (const double off_s : {0.0, 1.0, 2.0, 3.0}) {
    Variant variant{off_s, with_fluoroscopy_off_for(sequence, off_s, kPeriod_s)};
    variant.judged = [=](const SequenceInstant& instant) {
      return off_s == 0 || is_off(instant.t_s, start_s, off_s, kPeriod_s);
    };
    study.variants.push_back(std::move(variant));
  }
  return study;
}

Study drop_study(const Sequence& sequence) {
  Study study{"coils dropped, %", {}};
  for (const double percent : {0.0, 10.0, 25.0, 50.0}) {
    study.variants.push_back({percent, with_coils_dropped(sequence, percent / 100, 1)});
  }
  return study;
}

Study liar_study(const Sequence& sequence, const std::string& title, int coil) {
  Study study{title, {}};
  for (const double error_mm : {0.0, 6.0, 12.0, 25.0, 40.0}) {
    study.variants.push_back({error_mm, with_coil_lying(sequence, coil, error_mm, 1)});
  }
  return study;
}

/// The middle coil, whose absence costs most.
Study middle_liar_study(const Sequence& sequence) {
  const int middle = sequence.measurements.empty() ? 0 : sequence.measurements.front().coil_count / 2;
  return liar_study(sequence, "the middle coil wrong by, mm", middle);
}

/// The tip's coil, which has a neighbour on one side only.
Study tip_liar_study(const Sequence& sequence) {
  return liar_study(sequence, "the tip's coil wrong by, mm", 0);
}

/// The tip's coil, beyond which nothing is held. Only the instants without it are judged, but for 0, where
/// all are.
Study loose_tip_study(const Sequence& sequence) {
  constexpr double kPeriod_s = 8;
  Study study{"s of every 8 without the tip's coil (judged: these)", {}};
  const double start_s = sequence.measurements.empty() ? 0 : sequence.measurements.front().t_s;
  for (const double off_s : {0.0, 1.0, 2.0, 4.0}) {
    Variant variant{off_s, with_coil_missing(sequence, 0, off_s, kPeriod_s)};
    variant.judged = [=](const SequenceInstant& instant) {
      return off_s == 0 || is_off(instant.t_s, start_s, off_s, kPeriod_s);
    };
    study.variants.push_back(std::move(variant));
  }
  return study;
}

/// The tip's coil. Judged: while it is wrong and one second after;
/// all instants where it never is.
Study erratic_study(const Sequence& sequence) {
  constexpr double kPeriod_s = 4;
  constexpr double kError_mm = 25;
  constexpr double kAfter_s = 1;
  Study study{"s of every 4 the tip's coil erratic by 25 mm (judged: these + 1 s)", {}};
  const double start_s = sequence.measurements.empty() ? 0 : sequence.measurements.front().t_s;
  for (const double wrong_s : {0.0, 0.5, 1.0, 2.0}) {
    Variant variant{wrong_s, with_coil_erratic(sequence, 0, kError_mm, wrong_s, kPeriod_s, 1)};
    variant.judged = [=](const SequenceInstant& instant) {
      return wrong_s == 0 || is_off(instant.t_s - kAfter_s, start_s, wrong_s + kAfter_s, kPeriod_s);
    };
    study.variants.push_back(std::move(variant));
  }
  return study;
}

Study wrong_image_study(const Sequence& sequence) {
  Study study{"one of so many images is the first again (0: none)", {}};
  for (const std::size_t step : {0, 2, 5, 10}) {
    study.variants.push_back({static_cast<double>(step), with_wrong_images(sequence, step)});
  }
  return study;
}

/// Errors of the instants of a run that a variant judges, mm.
std::vector<double> judged_rms(const Variant& variant, const MethodRun& run) {
  const std::vector<SequenceInstant> instants = instants_of(variant.sequence);
  std::vector<double> rms;
  for (std::size_t i = 0; i < run.in_view.errors.size(); ++i) {
    if (run.in_view.errors[i] && variant.judged(instants[i])) rms.push_back(run.in_view.errors[i]->rms_mm);
  }
  return rms;
}

/// Share of those instants at which the tip is within three sigma.
double judged_tip_told(const Variant& variant, const MethodRun& run) {
  const std::vector<SequenceInstant> instants = instants_of(variant.sequence);
  double judged = 0;
  double told = 0;
  for (std::size_t i = 0; i < run.in_view.errors.size(); ++i) {
    if (run.in_view.errors[i] && variant.judged(instants[i])) {
      judged += 1;
      told += *run.in_view.tip_sigmas[i] <= 3 ? 1 : 0;
    }
  }
  return told / judged;
}

std::vector<Study> studies_of(const Sequence& sequence) {
  std::vector<Study> studies{coil_study(sequence), noise_study(sequence), registration_study(sequence),
                             rate_study(sequence)};
  if (sequence.room.cameras.size() > 1) studies.push_back(second_view_study(sequence));
  studies.push_back(coefficient_study(sequence));
  studies.push_back(fluoroscopy_study(sequence));
  studies.push_back(drop_study(sequence));
  studies.push_back(loose_tip_study(sequence));
  studies.push_back(middle_liar_study(sequence));
  studies.push_back(tip_liar_study(sequence));
  studies.push_back(erratic_study(sequence));
  studies.push_back(wrong_image_study(sequence));
  return studies;
}

std::vector<Study> studies_named(const Sequence& sequence, const std::string& wanted) {
  std::vector<Study> studies = studies_of(sequence);
  std::string titles;
  for (const Study& study : studies) titles += "\n  " + study.varied;
  std::erase_if(studies, [&](const Study& study) { return study.varied.find(wanted) == std::string::npos; });
  if (studies.empty())
    throw std::invalid_argument("no study with \"" + wanted + "\" in its title; there are:" + titles);
  return studies;
}

}  // namespace

Sequence measured_again(const Sequence& sequence, const CoilStudy& study) {
  if (sequence.truth.empty()) throw std::runtime_error(sequence.folder.string() + ": has no truth.csv");
  Sequence again = sequence;
  again.measurements.clear();
  std::vector<CoilPlacement>& coils = again.room.instruments.front().coils;
  coils.clear();
  for (const double offset_mm : study.offsets_mm) {
    coils.push_back({static_cast<int>(coils.size()) + 1, offset_mm, false});
  }
  const RigidTransform T_em_world = sequence.room.T_world_em.inverse();
  std::mt19937_64 random(study.seed);
  for (const SequenceInstant& instant : instants_of(sequence)) {
    const SequenceTruth* truth = find_truth(sequence, instant.frame);
    if (truth == nullptr || truth->points_world_mm.cols() < 2) continue;
    SequenceMeasurement& measurement = again.measurements.emplace_back();
    measurement.t_s = instant.t_s;
    measurement.em_frame = static_cast<std::uint32_t>(again.measurements.size());
    measurement.coil_count = static_cast<int>(study.offsets_mm.size());
    for (std::size_t i = 0; i < study.offsets_mm.size(); ++i) {
      measurement.coils[i] = measured(truth->points_world_mm, study.offsets_mm[i], study, T_em_world, random);
    }
  }
  return again;
}

Sequence misregistered(Sequence sequence, double error_mm, unsigned seed) {
  std::mt19937_64 random(seed);
  sequence.room.T_world_em.pretranslate(error_mm * random_direction(random));
  return sequence;
}

Sequence thinned(const Sequence& sequence, std::size_t step) {
  Sequence thin = sequence;
  thin.frames.clear();
  const std::vector<SequenceInstant> instants = instants_of(sequence);
  for (std::size_t i = 0; i < instants.size(); i += step) {
    for (const std::size_t row : instants[i].rows) thin.frames.push_back(sequence.frames[row]);
  }
  return thin;
}

Sequence with_second_view_every(Sequence sequence, std::size_t step) {
  std::size_t seen = 0;
  for (SequenceFrame& frame : sequence.frames) {
    if (frame.camera > 0 && (step == 0 || seen++ % step != 0)) frame.file.clear();
  }
  return sequence;
}

std::vector<SensitivityPanel> study_sensitivity(const Sequence& sequence, const std::vector<Method>& methods,
                                                const ShapeErrorSettings& judged, const std::string& wanted,
                                                const std::filesystem::path& scratch,
                                                const OnStudy& on_study) {
  std::vector<SensitivityPanel> panels;
  for (const Study& study : studies_named(sequence, wanted)) {
    SensitivityPanel& panel = panels.emplace_back(SensitivityPanel{study.varied, {}});
    for (const Method& method : methods) {
      if (method.images_withheld) continue;
      SensitivityCurve& curve = panel.curves.emplace_back(SensitivityCurve{method.name, {}, {}, {}});
      for (const Variant& variant : study.variants) {
        on_study(study.varied + " = " + std::to_string(variant.value) + ", " + method.name);
        Method changed = method;
        variant.change(changed.settings);
        const MethodRun run = run_method(variant.sequence, changed, judged, scratch, [](auto, auto) {});
        const std::vector<double> rms = judged_rms(variant, run);
        if (rms.empty()) continue;
        curve.values.push_back(variant.value);
        curve.error_mm.push_back(quantile(rms, 0.5));
        curve.tip_told.push_back(judged_tip_told(variant, run));
      }
    }
  }
  return panels;
}

}  // namespace tubed
