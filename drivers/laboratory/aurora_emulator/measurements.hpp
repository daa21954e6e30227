// The tracker's measurements: 40 a second, counted by 8.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "drivers/aurora/tracking_reply.hpp"
#include "drivers/laboratory/aurora_emulator/faults.hpp"
#include "drivers/laboratory/aurora_emulator/motion.hpp"

namespace tubed::aurora::emulator {

/// One measurement as the tracker reports it, faults of measurements included. Coil i is sensor i + 1; its
/// port_status has the bits of the coil alone, its handle means nothing.
struct Measurement {
  std::uint32_t frame = 0;
  MonotonicTime time{};
  std::array<HandleReading, kMaxTrackerCoils> coils;
};

/// One thread. Measurements are taken in order, each once, while tracking.
class Measurements {
 public:
  /// `faults` has to outlive it. `first_frame`: the counter at power-on.
  Measurements(Motion motion, double rate_hz, std::uint32_t first_frame, Faults& faults);

  /// Power-on: the counter is at its beginning, nothing is tracked, a standstill is over.
  void power_on(MonotonicTime now);
  /// INIT: the counter is at its beginning; a standstill goes on.
  void begin_count(MonotonicTime now);
  /// Counts from 0 at `now` (TSTART:80). Otherwise the counter goes on, whether anything is tracked or not.
  void count_anew(MonotonicTime now);
  void start(MonotonicTime now);
  void stop() { tracking_ = false; }
  /// Ends a standstill (Fault::kStandstill).
  void go_on() { still_until_ = {}; }
  [[nodiscard]] bool tracking() const { return tracking_; }

  /// Takes everything due until `now` and returns the newest; nullptr before the first since start(), unless
  /// the tracker stands still: then the last one before that.
  const Measurement* newest(MonotonicTime now);

  /// Told of every measurement that is taken.
  std::function<void(const Measurement&)> on_measurement;

 private:
  [[nodiscard]] MonotonicTime taken(std::int64_t count) const;
  [[nodiscard]] std::int64_t newest_count(MonotonicTime now) const;
  void measure(std::int64_t count);
  /// Counter and standstill as `fault` has them; false when there is no measurement then.
  bool strike_counter(std::optional<Fault> fault, MonotonicTime time);
  void take(std::int64_t count, MonotonicTime time, std::optional<Fault> fault);
  void report(const CoilSample& coil, CoilFault fault, HandleReading& reading) const;

  Motion motion_;
  double period_ns_;
  std::uint32_t power_on_frame_;
  Faults& faults_;
  MonotonicTime epoch_{};          ///< count 0
  std::uint32_t epoch_frame_ = 0;  ///< its frame number
  std::int64_t next_ = 0;          ///< count of the measurement to be taken next
  std::uint64_t taken_altogether_ = 0;
  bool tracking_ = false;
  bool have_one_ = false;
  MonotonicTime still_until_{};  ///< no measurement before
  Measurement newest_;
};

}  // namespace tubed::aurora::emulator
