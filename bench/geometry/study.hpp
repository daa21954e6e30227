// What estimates say in a room that is described wrong: one run of a preset with one mistake, judged by its
// truth.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "clients/evaluation/evaluation.hpp"
#include "clients/evaluation/simulated_run.hpp"

namespace tubed {

/// "none", a mistake of room_mistakes.hpp ("focal=1.08"), or a move that no image announces: "pan=MM",
/// "turn=DEG", "zoom=FACTOR", once, half way through. Throws std::invalid_argument for anything else.
SimulatedRun run_with(const std::string& mistake, const std::string& preset, std::int64_t seed);

/// From the estimated tip to the true one, mm, at each instant that `judged` has an error of.
std::vector<double> tip_errors_mm(const TrueRun& run, const Estimates& estimates,
                                  const MethodEvaluation& judged);

/// The runs of one preset and seed, one after the other. One thread.
class MistakeRuns {
 public:
  /// Sequence folders are written into `folder`, and taken from there where they are already.
  MistakeRuns(std::string preset, std::int64_t seed, int every, std::filesystem::path folder);

  /// One instant at which an estimate was due.
  struct Instant {
    double t_s = 0;
    bool has_image = false;
    Validity validity = Validity::kNotAvailable;
    Reasons reasons;
  };
  /// One run with mode filter.
  struct Outcome {
    std::vector<Instant> instants;  ///< in order of time
    MethodEvaluation in_view;       ///< of points in view, as the cameras really stood
    std::vector<double> tip_mm;     ///< from the estimated tip to the true one, where `in_view` has an error
    double began_s = 0;             ///< when the mistake began, or the first image came if that was later
  };
  [[nodiscard]] Outcome judge(const std::string& mistake);

 private:
  [[nodiscard]] Sequence sequence_of(const SimulatedRun& run, const Scenario& scenario);

  std::string preset_;
  std::int64_t seed_;
  int every_;
  std::filesystem::path folder_;
  std::shared_ptr<const Catheterisation> mechanics_;  ///< kept, so that they run once
};

/// What was said of a mistake: instants that are QUESTIONABLE or INVALID where the run without mistakes is
/// VALID.
struct Said {
  std::optional<double> first_s;  ///< after Outcome::began_s; nothing: never
  Reasons first_reasons;
  std::size_t instants = 0;
  std::map<std::string, std::size_t> reasons;  ///< at how many of them
};

/// Precondition: both have the same instants.
Said said_of(const MistakeRuns::Outcome& mistaken, const MistakeRuns::Outcome& without);

}  // namespace tubed
