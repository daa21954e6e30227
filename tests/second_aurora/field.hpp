// The measurements: when they are taken, what the frame counter says, which pose of each coil is reported.
// Used by SecondAurora only, in its thread.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>

#include "tests/second_aurora/mischief.hpp"
#include "tests/second_aurora/port_table.hpp"
#include "tests/second_aurora/settings.hpp"

namespace tubed::second_aurora {

// Where the coil of (port, channel) is at `time_ns`.
using Motion = std::function<Pose(int port, int channel, std::int64_t time_ns)>;

class Field {
 public:
  // Settings and mischief are kept by reference and outlive the field.
  Field(const Settings& settings, Motion motion, Mischief& mischief);

  // Power on or reset: the counter starts anew and every fault of measurements ends.
  void start(std::int64_t now_ns, std::uint32_t first_frame);
  std::int64_t next_measurement_ns() const { return next_ns_; }
  // Takes the measurement that is due; nullptr when there is none to report (not tracking, counter stands
  // still).
  const Truth* measure(const PortTable& ports, bool tracking);
  // The newest measurement that a reply composed now may contain; nullptr before the first one.
  const Truth* newest(std::int64_t now_ns) const;

  // TSTART; with the counter standing still the old measurement survives.
  void tracking_starts(bool counter_restarts);

  void unplug_generator() { generator_plugged_ = false; }
  void plug_generator() { generator_plugged_ = true; }
  bool generator_plugged() const { return generator_plugged_; }
  std::uint64_t count() const { return count_; }

 private:
  struct CoilFault {
    int port = 0, channel = 0;
    CoilState state = CoilState::Missing;
    std::int64_t until_ns = 0;
  };

  void begin(const Fault& fault, const std::vector<const Handle*>& coils);
  CoilTruth measured(const Handle& handle, std::int64_t time_ns);
  CoilTruth before(const CoilTruth& coil) const;
  bool counter_stands() const { return next_ns_ < stands_until_ns_; }

  const Settings& settings_;
  Motion motion_;
  Mischief& mischief_;
  std::int64_t start_ns_ = 0, next_ns_ = INT64_MAX;
  std::uint64_t tick_ = 0;
  std::uint32_t frame_ = 0;  // of the next measurement
  std::uint64_t count_ = 0;
  std::deque<Truth> recent_;
  std::int64_t stands_until_ns_ = INT64_MIN, stuck_until_ns_ = INT64_MIN;
  std::vector<CoilFault> coil_faults_;
  bool generator_plugged_ = true;
};

}  // namespace tubed::second_aurora
