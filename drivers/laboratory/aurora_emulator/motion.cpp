#include "drivers/laboratory/aurora_emulator/motion.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <utility>

namespace tubed::aurora::emulator {

namespace {

bool earlier(const RecordedCoils& a, const RecordedCoils& b) { return a.t_s < b.t_s; }

bool in_order(const std::vector<RecordedCoils>& rows) {
  return std::adjacent_find(rows.begin(), rows.end(), [](const RecordedCoils& a, const RecordedCoils& b) {
           return !earlier(a, b);
         }) == rows.end();
}

/// From the first row to the end of the last one, which lasts as long as the others do on average.
double period_s(const std::vector<RecordedCoils>& rows) {
  const double span_s = rows.back().t_s - rows.front().t_s;
  const auto count = static_cast<double>(rows.size());
  return rows.size() == 1 ? 1 : span_s * count / (count - 1);
}

}  // namespace

Motion play_recording(std::vector<RecordedCoils> rows, MonotonicTime start) {
  if (rows.empty() || !in_order(rows)) {
    throw std::invalid_argument(rows.empty() ? "a recording without measurements cannot be played"
                                             : "the recording's times do not increase from row to row");
  }
  const auto shared = std::make_shared<const std::vector<RecordedCoils>>(std::move(rows));
  return [shared, start, period = period_s(*shared)](std::uint64_t, MonotonicTime time) {
    const double into_s = std::fmod(std::max(0.0, seconds_between(start, time)), period);
    const RecordedCoils wanted{shared->front().t_s + into_s, {}};
    const auto after = std::upper_bound(shared->begin(), shared->end(), wanted, earlier);
    return after == shared->begin() ? shared->front().coils : std::prev(after)->coils;
  };
}

Quaternion min_rotation(const Eigen::Vector3d& axis) noexcept {
  const double q0 = std::sqrt(std::max(0.0, (1 + axis.z()) / 2));
  constexpr double kHalfTurn = 1e-6;  // below it the axis of the turn is any across z
  if (q0 < kHalfTurn) {
    return {0, 1, 0, 0};
  }
  return {q0, 0.0 - axis.y() / (2 * q0), axis.x() / (2 * q0), 0};  // never -0
}

}  // namespace tubed::aurora::emulator
