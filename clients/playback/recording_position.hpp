// Where a recording is being looked at. Pure: whoever calls says what time it is.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace tubed {

/// Instants of a recording, one of which is shown: stands still, or goes on with time. What is not ready yet
/// cannot be reached; there it waits and goes on by itself.
class RecordingPosition {
 public:
  static constexpr double kMinSpeed = 1.0 / 16;
  static constexpr double kMaxSpeed = 16;

  /// `times_s`: of the instants, rising. Precondition: at least one.
  explicit RecordingPosition(std::vector<double> times_s);

  /// The first `count` instants can be shown.
  void set_ready(std::size_t count);
  /// Moves on until `now_s`, if it plays. Every other call moves on first.
  void advance(double now_s);

  /// From the last instant on it begins anew.
  void play(double now_s);
  void pause(double now_s);
  /// To the newest instant that is not later than `t_s`, or the nearest there is. Not a number: nothing.
  void seek(double t_s, double now_s);
  /// So many instants on, or back; stands still afterwards.
  void step(int instants, double now_s);
  /// Seconds of the recording a second, kept within its limits. Not a number: nothing.
  void set_speed(double speed, double now_s);

  /// The instant that is shown; nothing while none is ready.
  [[nodiscard]] std::optional<std::size_t> instant() const;
  /// Time of the recording, s.
  [[nodiscard]] double t_s() const { return t_s_; }
  [[nodiscard]] bool is_playing() const { return is_playing_; }
  [[nodiscard]] double speed() const { return speed_; }

 private:
  [[nodiscard]] std::size_t instant_at(double t_s) const;

  std::vector<double> times_s_;
  std::size_t ready_ = 0;
  double t_s_;
  std::optional<double> now_s_;  ///< when t_s_ was right; nothing: nobody has asked yet
  double speed_ = 1;
  bool is_playing_ = true;
};

}  // namespace tubed
