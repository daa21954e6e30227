#include "clients/calibration/marker_collector.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "clients/calibration/formatted.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

constexpr std::size_t kStillMeasurements = 10;
constexpr double kMoved_mm = 3;          // from where the tip held still
constexpr std::size_t kTellEvery = 200;  // measurements, 5 s at 40 Hz
constexpr std::size_t kTellUnseen = 40;

Eigen::Vector3d mean_of(const std::vector<Eigen::Vector3d>& points, std::size_t count) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < count; ++i) sum += points[i];
  return sum / static_cast<double>(count);
}

double scatter_of(const std::vector<Eigen::Vector3d>& points) {
  const Eigen::Vector3d mean = mean_of(points, points.size());
  double squared = 0;
  for (const Eigen::Vector3d& point : points) squared += (point - mean).squaredNorm();
  return std::sqrt(squared / static_cast<double>(points.size()));
}

}  // namespace

MarkerCollector::MarkerCollector(std::vector<std::string> names, CollectorSettings settings)
    : names_(std::move(names)), settings_(settings), touched_(names_.size()) {}

std::vector<std::string> MarkerCollector::type(const std::string& word) {
  if (word == "q") {
    is_finished_ = true;
    return {};
  }
  if (word.empty()) {
    const auto missing = next_missing();
    is_finished_ = !missing;
    return missing ? ask_for(*missing) : Lines{};
  }
  const auto marker = find(word);
  return marker ? ask_for(*marker)
                : Lines{"there is no marker \"" + printable_text(word) + "\"; there are " + list_of(names_) +
                        "; Enter asks for the next one, q ends"};
}

std::vector<std::string> MarkerCollector::add(const ProbePose& pose) {
  if (state_ == State::kNothingAsked || frame_ == pose.frame) {
    return {};
  }
  frame_ = pose.frame;
  if (!pose.is_seen) {
    ++unseen_;
    if (unseen_ % kTellUnseen != 0) return {};
    restart();
    return {"the tracker does not see the probe: is it plugged in, and inside of the field?"};
  }
  unseen_ = 0;
  tips_em_mm_.emplace_back(pose.p_em_mm + pose.q_em_probe * settings_.tip_offset_mm);
  return state_ == State::kWaiting ? wait_for_stillness() : measure();
}

std::vector<TouchedMarker> MarkerCollector::touched() const {
  std::vector<TouchedMarker> there;
  for (const auto& marker : touched_) {
    if (marker) there.push_back(*marker);
  }
  return there;
}

std::vector<Marker> MarkerCollector::markers() const {
  std::vector<Marker> markers;
  for (const TouchedMarker& marker : touched()) markers.push_back({marker.name, marker.p_em_mm});
  return markers;
}

std::vector<std::string> MarkerCollector::ask_for(std::size_t marker) {
  marker_ = marker;
  restart();
  const std::string again = touched_[marker] ? " again" : "";
  return {"touch " + printable_text(names_[marker]) + again + " with the tip and hold still"};
}

void MarkerCollector::restart() {
  state_ = State::kWaiting;
  tips_em_mm_.clear();
  restless_ = 0;
}

std::vector<std::string> MarkerCollector::wait_for_stillness() {
  ++restless_;
  if (tips_em_mm_.size() < kStillMeasurements) return {};
  const double scatter_mm = scatter_of(tips_em_mm_);
  if (scatter_mm <= settings_.max_scatter_mm) {
    state_ = State::kMeasuring;
    return {printable_text(names_[marker_]) + ": measuring"};
  }
  tips_em_mm_.erase(tips_em_mm_.begin());
  if (restless_ % kTellEvery != 0) return {};
  return {
      formatted("not still yet: the last %zu measurements scatter by %.2f mm RMS, at most %.2f are wanted",
                kStillMeasurements, scatter_mm, settings_.max_scatter_mm)};
}

std::vector<std::string> MarkerCollector::measure() {
  if ((tips_em_mm_.back() - mean_of(tips_em_mm_, kStillMeasurements)).norm() > kMoved_mm) {
    restart();
    return {printable_text(names_[marker_]) + ": the tip has moved; hold still, it begins anew"};
  }
  if (tips_em_mm_.size() < settings_.measurements) return {};
  const double scatter_mm = scatter_of(tips_em_mm_);
  if (scatter_mm <= settings_.max_scatter_mm) return finish_marker(scatter_mm);
  restart();
  return {
      printable_text(names_[marker_]) +
      formatted(": refused, it scattered by %.2f mm RMS, at most %.2f are wanted; hold still, it begins anew",
                scatter_mm, settings_.max_scatter_mm)};
}

std::vector<std::string> MarkerCollector::finish_marker(double scatter_mm) {
  touched_[marker_] = TouchedMarker{names_[marker_], mean_of(tips_em_mm_, tips_em_mm_.size()), scatter_mm};
  state_ = State::kNothingAsked;
  return {printable_text(names_[marker_]) + formatted(": taken, %zu measurements that scatter by %.2f mm RMS",
                                                      tips_em_mm_.size(), scatter_mm),
          next_step()};
}

std::string MarkerCollector::next_step() const {
  const auto missing = next_missing();
  return formatted("%zu of %zu touched; ", touched().size(), names_.size()) +
         (missing ? "Enter for " + printable_text(names_[*missing]) + ", a name for that one, q to end here"
                  : "Enter to register, a name to touch that one again");
}

std::optional<std::size_t> MarkerCollector::next_missing() const {
  const auto missing = std::find(touched_.begin(), touched_.end(), std::nullopt);
  return missing == touched_.end() ? std::nullopt
                                   : std::optional(static_cast<std::size_t>(missing - touched_.begin()));
}

std::optional<std::size_t> MarkerCollector::find(const std::string& word) const {
  const auto named = std::find(names_.begin(), names_.end(), word);
  if (named != names_.end()) return static_cast<std::size_t>(named - names_.begin());
  std::size_t number = 0;
  const char* const end = word.data() + word.size();
  const auto [stopped, error] = std::from_chars(word.data(), end, number);
  const bool is_number = error == std::errc{} && stopped == end;
  return is_number && number >= 1 && number <= names_.size() ? std::optional(number - 1) : std::nullopt;
}

}  // namespace tubed
