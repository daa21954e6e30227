#include "clients/evaluation/recording_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "clients/evaluation/agreement_parts.hpp"
#include "clients/evaluation/finding_text.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/evaluation/room_readings.hpp"

namespace tubed {

namespace {

using Verdict = RecordingFinding::Verdict;

constexpr int kImagesTried = 60;       // for each way of reading them
constexpr int kMinImages = 8;          // with the tube in view, to judge
constexpr double kMinInView = 0.15;    // share of the tube
constexpr double kAgrees = 0.7;        // share of lines where the tube is seen
constexpr double kLost = 0.6;          // below, what agrees is by chance and by other lines
constexpr double kMinConfirmed = 0.3;  // share of the instants at which an image took part, to judge both
constexpr double kBetterBy = 0.15;     // another way of reading is the right one
constexpr std::size_t kMaxExplanations = 3;
constexpr double kSeldom = 0.05;  // share of the instants that needs no word

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

/// Where images do not show the tube: do they, if the room's numbers are understood in another way?
std::optional<RecordingFinding> check_room(const ConfiguredSequence& run, std::optional<double> stated) {
  RecordingFinding finding{"poses", Verdict::kWrong, "", ""};
  double best = stated.value_or(0) + kBetterBy;
  for (RoomReading& reading : other_readings(run.sequence.room)) {
    ConfiguredSequence other = run;
    other.sequence.room = std::move(reading.room);
    if (!is_any_coil_in_view(other.sequence)) continue;
    const std::optional<double> seen = share_seen(std::move(other));
    if (!seen || *seen < std::max(best, kAgrees)) continue;
    best = *seen;
    finding.evidence = text_of("%.0f %% of the tube's lines agree %s", *seen * 100, reading.words.c_str());
    finding.advice = reading.advice;
  }
  return finding.advice.empty() ? std::nullopt : std::optional(finding);
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
RecordingFinding check_tube_in_images(std::optional<double> seen, const Sequence& sequence) {
  RecordingFinding finding{"tube in images", Verdict::kNotJudged, "too few images with the tube in view", ""};
  if (!seen) {
    if (!is_any_coil_in_view(sequence)) {
      finding.evidence = "no coil ever lies where a camera sees it";
      finding.advice =
          "either the C-arm looked elsewhere all the time, or T_world_em or T_camera_world is not what it is "
          "said to be";
    }
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
  findings.push_back(check_tube_in_images(polarity.stated, run.sequence));
  if (polarity.stated.value_or(0) < kLost) {
    progress("understanding the room's poses in other ways");
    if (const auto finding = check_room(read, polarity.stated)) findings.push_back(*finding);
  }
  findings.push_back(check_polarity(polarity));
  progress("reading mirrored images");
  findings.push_back(check_mirrored(read, polarity.stated));
  progress("looking for averaged images");
  const std::vector<RecordingFinding> averaging = check_averaging(run.sequence);
  findings.insert(findings.end(), averaging.begin(), averaging.end());
  progress("going through the whole recording");
  check_agreement(run, findings);
  return findings;
}

}  // namespace tubed
