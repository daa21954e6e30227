#include "clients/evaluation/recording_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>

#include "clients/evaluation/agreement_parts.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"

namespace tubed {

namespace {

using Verdict = RecordingFinding::Verdict;

constexpr int kMinMeasurements = 20;   // of a pair of coils, to judge it
constexpr double kMostly = 0.9;        // share of the measurements
constexpr double kMaxExcess_mm = 4;    // that two coils may lie further apart than along the tube
constexpr int kImagesTried = 60;       // for each way of reading them
constexpr int kMinImages = 8;          // with the tube in view, to judge
constexpr double kMinInView = 0.15;    // share of the tube
constexpr double kAgrees = 0.7;        // share of lines where the tube is seen
constexpr double kLost = 0.6;          // below, what agrees is by chance and by other lines
constexpr double kMinConfirmed = 0.3;  // share of the instants at which an image took part, to judge both
constexpr double kBetterBy = 0.15;     // another way of reading is the right one
constexpr std::size_t kMaxExplanations = 3;
constexpr double kSeldom = 0.05;  // share of the instants that needs no word

std::string text_of(const char* format, auto... values) {
  std::array<char, 320> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

const CoilSample* sample_of(const SequenceMeasurement& measurement, const CoilPlacement& coil) {
  const int index = coil.sensor - 1;
  if (index < 0 || index >= measurement.coil_count) {
    return nullptr;
  }
  const CoilSample& sample = measurement.coils[static_cast<std::size_t>(index)];
  return sample.status == CoilStatus::kOk ? &sample : nullptr;
}

/// Calls `on_pair(nearer, further)` for each measurement that has both.
template <typename OnPair>
void for_each_pair(const Sequence& sequence, const CoilPlacement& nearer, const CoilPlacement& further,
                   const OnPair& on_pair) {
  for (const SequenceMeasurement& measurement : sequence.measurements) {
    const CoilSample* const a = sample_of(measurement, nearer);
    const CoilSample* const b = sample_of(measurement, further);
    if (a != nullptr && b != nullptr) {
      on_pair(*a, *b);
    }
  }
}

/// How often a coil pointed away from the tip, of how many measurements.
struct Backward {
  int times = 0;
  int of = 0;
  [[nodiscard]] bool mostly() const { return of >= kMinMeasurements && times > kMostly * of; }
};

Backward backward_times(const Sequence& sequence, std::size_t coil) {
  const std::vector<CoilPlacement>& coils = sequence.room.instruments.front().coils;
  Backward found;
  const auto count = [&found](const Eigen::Vector3d& toward_tip, const CoilSample& sample, bool flipped) {
    const double dot = toward_tip.dot(sample.tangent_em) * (flipped ? -1 : 1);
    found.times += dot < 0 ? 1 : 0;
    ++found.of;
  };
  if (coil > 0) {
    for_each_pair(sequence, coils[coil - 1], coils[coil], [&](const CoilSample& a, const CoilSample& b) {
      count(a.p_em_mm - b.p_em_mm, b, coils[coil].flipped);
    });
  }
  if (coil + 1 < coils.size()) {
    for_each_pair(sequence, coils[coil], coils[coil + 1], [&](const CoilSample& a, const CoilSample& b) {
      count(a.p_em_mm - b.p_em_mm, a, coils[coil].flipped);
    });
  }
  return found;
}

}  // namespace

RecordingFinding check_coil_directions(const Sequence& sequence) {
  const std::vector<CoilPlacement>& coils = sequence.room.instruments.front().coils;
  RecordingFinding finding{"coil directions", Verdict::kFine, "", ""};
  int judged = 0;
  std::vector<std::size_t> backward;
  for (std::size_t i = 0; i < coils.size(); ++i) {
    const Backward times = backward_times(sequence, i);
    judged += times.of >= kMinMeasurements ? 1 : 0;
    if (times.mostly()) {
      backward.push_back(i);
    }
  }
  if (judged == 0) {
    return {finding.what, Verdict::kNotJudged, "too few measurements with two neighbouring coils", ""};
  }
  if (backward.empty()) {
    finding.evidence = text_of("each of %d coils points toward its neighbour nearer the tip", judged);
    return finding;
  }
  finding.verdict = Verdict::kWrong;
  if (static_cast<int>(backward.size()) == judged) {
    finding.evidence = text_of("all %d coils point away from the tip", judged);
    finding.advice =
        "either their order is the wrong way round (offset_from_tip_mm counts from the tip), or each is "
        "mounted "
        "backward (flipped = true)";
    return finding;
  }
  for (const std::size_t i : backward) {
    finding.evidence +=
        text_of("%scoil %zu (sensor %d)", finding.evidence.empty() ? "" : ", ", i + 1, coils[i].sensor);
  }
  finding.evidence += backward.size() == 1 ? " points away from the tip" : " point away from the tip";
  finding.advice = "flipped = true there, or its sensor number belongs to another coil";
  return finding;
}

RecordingFinding check_coil_distances(const Sequence& sequence) {
  const std::vector<CoilPlacement>& coils = sequence.room.instruments.front().coils;
  RecordingFinding finding{"coil distances", Verdict::kNotJudged,
                           "too few measurements with two neighbouring coils", ""};
  double largest_mm = -1e9;
  for (std::size_t i = 0; i + 1 < coils.size(); ++i) {
    std::vector<double> distances_mm;
    for_each_pair(sequence, coils[i], coils[i + 1], [&](const CoilSample& a, const CoilSample& b) {
      distances_mm.push_back((a.p_em_mm - b.p_em_mm).norm());
    });
    if (distances_mm.size() < kMinMeasurements) {
      continue;
    }
    const auto middle = distances_mm.begin() + static_cast<std::ptrdiff_t>(distances_mm.size() / 2);
    std::nth_element(distances_mm.begin(), middle, distances_mm.end());
    const double along_mm = std::abs(coils[i + 1].offset_from_tip_mm - coils[i].offset_from_tip_mm);
    if (*middle - along_mm > largest_mm) {
      largest_mm = *middle - along_mm;
      finding.verdict = largest_mm > kMaxExcess_mm ? Verdict::kWrong : Verdict::kFine;
      finding.evidence = text_of("coils %zu and %zu lie %.1f mm apart, %.1f mm along the tube", i + 1, i + 2,
                                 *middle, along_mm);
    }
  }
  if (finding.verdict == Verdict::kWrong) {
    finding.advice =
        "nothing bends a tube longer than it is: check offset_from_tip_mm of both, and the sensor numbers";
  } else if (finding.verdict == Verdict::kFine) {
    finding.evidence += ", at most";
  }
  return finding;
}

namespace {

/// How well images show the tube where their coils have it: share of the lines that agree, mean of the images
/// with the tube in view. Nothing with fewer than kMinImages.
std::optional<double> share_seen(ConfiguredSequence run) {
  run.estimator.mode = EstimatorMode::kJoint;  // depends on nothing but its instant
  const RoomDescription& room = run.sequence.room;
  const auto estimator = make_estimator(run.estimator, room.instruments.front(), room);
  const auto estimate = std::make_unique<TubeEstimate>();
  double sum = 0;
  int count = 0;
  const auto shown =
      static_cast<int>(std::count_if(run.sequence.frames.begin(), run.sequence.frames.end(),
                                     [](const SequenceFrame& frame) { return frame.fluoroscopy_on(); }));
  std::vector<SequenceFrame> thinned;
  int seen = 0;
  const int every = std::max(1, shown / kImagesTried);
  for (const SequenceFrame& frame : run.sequence.frames) {
    if (frame.fluoroscopy_on() && seen++ % every == 0) {
      thinned.push_back(frame);
    }
  }
  run.sequence.frames = std::move(thinned);
  observe_in_turn(
      run.sequence, Images::kMeasured, run.frangi,
      [&](const SequenceInstant&, const Observation& observation, AreaPredictions&) {
        estimator->estimate(observation, *estimate);
        if (static_cast<double>(estimate->in_view_ratio) >= kMinInView) {
          sum += static_cast<double>(estimate->image_inlier_ratio);
          ++count;
        }
        return true;
      },
      run.max_image_timeout);
  return count >= kMinImages ? std::optional(sum / count) : std::nullopt;
}

RecordingFinding compare_readings(const std::string& what, std::optional<double> stated,
                                  std::optional<double> other, const char* stated_words,
                                  const char* other_words, const std::string& advice) {
  RecordingFinding finding{what, Verdict::kNotJudged, "too few images with the tube in view", ""};
  if (!stated || !other) {
    return finding;
  }
  finding.evidence = text_of("%.0f %% of the tube's lines agree %s, %.0f %% %s", *stated * 100, stated_words,
                             *other * 100, other_words);
  if (*other > *stated + kBetterBy && *other >= kAgrees) {
    finding.verdict = Verdict::kWrong;
    finding.advice = advice;
  } else if (*stated >= kAgrees || *stated > *other + kBetterBy) {
    finding.verdict = Verdict::kFine;
  }
  return finding;
}

// Of everything that is off by more than lines reach, the registration or the pose first of all.
RecordingFinding check_tube_in_images(std::optional<double> seen) {
  RecordingFinding finding{"tube in images", Verdict::kNotJudged, "too few images with the tube in view", ""};
  if (!seen) {
    return finding;
  }
  finding.evidence = text_of("%.0f %% of the tube's lines agree where the coils have it", *seen * 100);
  finding.verdict = *seen >= kAgrees ? Verdict::kFine : *seen < kLost ? Verdict::kWrong : Verdict::kNotJudged;
  if (finding.verdict == Verdict::kWrong) {
    finding.advice =
        "unless something below explains it, all of it is off by more than a centimetre: check the "
        "registration "
        "(T_world_em), the camera's pose, and that images and coils are of one recording";
  }
  return finding;
}

/// How well images show the tube as they are read and as negatives.
struct PolarityShares {
  RidgePolarity read_for = RidgePolarity::kDark;
  std::optional<double> stated;
  std::optional<double> other;
};

/// `run` is read for what is found where its configuration leaves it open.
PolarityShares measure_polarity(ConfiguredSequence& run, const OnCheckProgress& progress) {
  PolarityShares shares{first_polarity(run.frangi.polarity), std::nullopt, std::nullopt};
  const bool is_dark = shares.read_for == RidgePolarity::kDark;
  ConfiguredSequence negative = run;
  negative.frangi.polarity = is_dark ? PolaritySetting::kBright : PolaritySetting::kDark;
  progress("reading images as they are");
  shares.stated = share_seen(run);
  progress("reading images with the other polarity");
  shares.other = share_seen(negative);
  if (run.frangi.polarity == PolaritySetting::kAuto && shares.stated && shares.other &&
      *shares.other > *shares.stated + kBetterBy && *shares.other >= kAgrees) {
    run = negative;
    shares = {RidgePolarity::kBright, shares.other, shares.stated};
  }
  return shares;
}

RecordingFinding check_polarity(const PolarityShares& shares) {
  const bool is_dark = shares.read_for == RidgePolarity::kDark;
  return compare_readings("polarity", shares.stated, shares.other,
                          is_dark ? "for a dark tube" : "for a bright tube",
                          is_dark ? "for a bright one" : "for a dark one",
                          is_dark ? "[frangi] polarity = \"bright\"" : "[frangi] polarity = \"dark\"");
}

RecordingFinding check_mirrored(const ConfiguredSequence& run, std::optional<double> stated) {
  ConfiguredSequence other = run;
  for (CameraCalibration& camera : other.sequence.room.cameras) {
    camera.mirrored = !camera.mirrored;
  }
  return compare_readings("mirrored images", stated, share_seen(other), "as the images are",
                          "in their mirror images",
                          "mirrored = true in [[camera]], or the grabber turns them");
}

/// Without its numbers: which mistake it is about.
std::string kind_of(std::string words) {
  words.erase(
      std::remove_if(words.begin(), words.end(),
                     [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.'; }),
      words.end());
  return words;
}

/// Words of one kind.
struct Said {
  int times = 0;
  std::string newest;
};

/// The kinds that were said most often, kMaxExplanations at most.
std::string most_said(const std::map<std::string, Said>& said, int instants) {
  std::vector<Said> all;
  for (const auto& [kind, entry] : said) {
    all.push_back(entry);
  }
  std::sort(all.begin(), all.end(), [](const Said& a, const Said& b) { return a.times > b.times; });
  all.resize(std::min(all.size(), kMaxExplanations));
  std::string text;
  for (const Said& entry : all) {
    text += text_of("%sin %.0f %%: %s", text.empty() ? "" : "; ", 100.0 * entry.times / instants,
                    entry.newest.c_str());
  }
  return text;
}

/// The whole recording, as the daemon would see it.
void check_agreement(const ConfiguredSequence& run, std::vector<RecordingFinding>& findings) {
  std::map<std::string, Said> said;
  RecordedAgreement recorded;
  int instants = 0;
  int disagreed = 0;
  int confirmed = 0;
  int moved = 0;
  ConfiguredSequence filtered = run;
  filtered.estimator.mode = EstimatorMode::kFilter;
  const RoomDescription& room = filtered.sequence.room;
  const auto estimator = make_estimator(filtered.estimator, room.instruments.front(), room);
  const auto estimate = std::make_unique<TubeEstimate>();
  observe_in_turn(
      filtered.sequence, Images::kMeasured, filtered.frangi,
      [&](const SequenceInstant&, const Observation& observation, AreaPredictions& next) {
        estimator->estimate(observation, *estimate);
        next.add(*estimator, *estimate);
        recorded.add(*estimate);
        std::array<char, 256> words{};
        ++instants;
        moved += observation.geometry_changed ? 1 : 0;
        confirmed += estimate->has_image ? 1 : 0;
        if (estimator->describe_disagreement(words)) {
          ++disagreed;
          Said& entry = said[kind_of(words.data())];
          ++entry.times;
          entry.newest = words.data();
        }
        return true;
      },
      filtered.max_image_timeout);
  const auto share = [instants](int times) {
    return instants > 0 ? static_cast<double>(times) / instants : 0.0;
  };
  RecordingFinding agreement{"coils and images",
                             share(disagreed) > kSeldom ? Verdict::kWrong : Verdict::kFine,
                             text_of("they disagree%s in %.0f %% of %d instants",
                                     disagreed > 0 ? ", or the instrument is not as configured," : "",
                                     100 * share(disagreed), instants),
                             ""};
  if (agreement.verdict == Verdict::kFine && share(confirmed) < kMinConfirmed) {
    agreement.verdict = Verdict::kNotJudged;
    agreement.evidence = text_of("images showed the tube where the coils have it in %.0f %% of %d instants",
                                 100 * share(confirmed), instants);
  }
  if (agreement.verdict == Verdict::kWrong) {
    agreement.advice = most_said(said, instants);
  }
  findings.push_back(agreement);
  if (agreement.verdict != Verdict::kNotJudged) {
    const std::vector<RecordingFinding> parts = recorded.findings(kSeldom);
    findings.insert(findings.end(), parts.begin(), parts.end());
  }
  findings.push_back(
      {"view", share(moved) > 0 ? Verdict::kWrong : Verdict::kFine,
       text_of("it had moved, or may have, in %.0f %% of the instants", 100 * share(moved)),
       share(moved) > 0 ? "record the pose of each image (geometry.csv), or cut the recording there" : ""});
}

}  // namespace

std::vector<RecordingFinding> check_recording(const ConfiguredSequence& run,
                                              const OnCheckProgress& progress) {
  std::vector<RecordingFinding> findings{check_coil_directions(run.sequence),
                                         check_coil_distances(run.sequence)};
  const bool has_images = std::any_of(run.sequence.frames.begin(), run.sequence.frames.end(),
                                      [](const SequenceFrame& frame) { return frame.fluoroscopy_on(); });
  if (!has_images) {
    findings.push_back({"coils and images", Verdict::kNotJudged, "the recording has no images", ""});
    return findings;
  }
  ConfiguredSequence read = run;
  const PolarityShares polarity = measure_polarity(read, progress);
  findings.push_back(check_tube_in_images(polarity.stated));
  findings.push_back(check_polarity(polarity));
  progress("reading mirrored images");
  findings.push_back(check_mirrored(read, polarity.stated));
  progress("going through the whole recording");
  check_agreement(run, findings);
  return findings;
}

}  // namespace tubed
