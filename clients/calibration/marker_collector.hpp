// Touching markers one after the other with a tracked probe: decides what counts as touched.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/probe_pose.hpp"
#include "clients/markers/marker_file.hpp"

namespace tubed {

struct CollectorSettings {
  std::size_t measurements = 40;                            ///< that are averaged
  double max_scatter_mm = 0.5;                              ///< RMS about their mean; more is refused
  Eigen::Vector3d tip_offset_mm = Eigen::Vector3d::Zero();  ///< in the probe's frame
};

/// A marker and how well it was touched.
struct TouchedMarker {
  std::string name;
  Eigen::Vector3d p_em_mm;
  double scatter_mm = 0;  ///< RMS of the measurements about their mean
};

/// Fed with what a person types and what the tracker measures, answers with lines to show. The person names a
/// marker (by its name, its number from 1, or Enter for the next one that is missing), holds the tip on it,
/// and is told when it is done; a marker that was touched is replaced by naming it again. "q" ends. A marker
/// counts when so many measurements in a row, begun when the tip held still, scatter little enough. Of one
/// thread; reads no clock.
class MarkerCollector {
 public:
  /// `names` as the world has them.
  MarkerCollector(std::vector<std::string> names, CollectorSettings settings);

  std::vector<std::string> type(const std::string& word);
  /// Measurements with the frame number of the one before are the same one, and are passed over.
  std::vector<std::string> add(const ProbePose& pose);

  /// "q" was typed, or Enter with nothing missing.
  [[nodiscard]] bool is_finished() const { return is_finished_; }
  /// In the order of the names; without those that are missing.
  [[nodiscard]] std::vector<TouchedMarker> touched() const;
  /// The same as a file has them.
  [[nodiscard]] std::vector<Marker> markers() const;

 private:
  enum class State { kNothingAsked, kWaiting, kMeasuring };
  using Lines = std::vector<std::string>;

  Lines ask_for(std::size_t marker);
  Lines wait_for_stillness();
  Lines measure();
  Lines finish_marker(double scatter_mm);
  void restart();
  [[nodiscard]] std::string next_step() const;
  [[nodiscard]] std::optional<std::size_t> next_missing() const;
  [[nodiscard]] std::optional<std::size_t> find(const std::string& word) const;

  std::vector<std::string> names_;
  CollectorSettings settings_;
  std::vector<std::optional<TouchedMarker>> touched_;
  State state_ = State::kNothingAsked;
  std::size_t marker_ = 0;  ///< that is asked for
  std::vector<Eigen::Vector3d> tips_em_mm_;
  std::optional<std::uint32_t> frame_;
  std::size_t unseen_ = 0;    ///< measurements in a row
  std::size_t restless_ = 0;  ///< measurements since it is waited for stillness
  bool is_finished_ = false;
};

}  // namespace tubed
