// The tracker behind the wire: one command line in, one reply out, time as a value.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "drivers/aurora/command.hpp"
#include "drivers/laboratory/aurora_emulator/device_settings.hpp"
#include "drivers/laboratory/aurora_emulator/measurements.hpp"
#include "drivers/laboratory/aurora_emulator/port_handles.hpp"

namespace tubed::aurora::emulator {

/// How a command was answered.
struct Answer {
  std::vector<std::uint8_t> reply;      ///< whole, check sums and all
  std::chrono::nanoseconds thinking{};  ///< before it
  bool has_tracking_data = false;       ///< of TX or BX
  std::optional<LinkParameters> link;   ///< how the wire is set when the reply has been sent
  bool starts_anew = false;             ///< RESET: no reply but the word after the restart
};

/// One thread. `measurements` and `conditions` have to outlive it.
class Tracker {
 public:
  Tracker(const DeviceSettings& settings, Measurements& measurements, SystemConditions& conditions);

  /// Power-on, break or RESET.
  void start_anew(MonotonicTime now);
  /// `line`: a command without its carriage return.
  [[nodiscard]] Answer execute(std::string_view line, MonotonicTime now);

  PortHandles& ports() noexcept { return ports_; }

 private:
  struct Rule;
  static const Rule* find_rule(std::string_view name);
  [[nodiscard]] Error refusal(const Rule& rule) const;

  void reset(std::string_view parameters, MonotonicTime now, Answer& answer);
  void init(std::string_view parameters, MonotonicTime now, Answer& answer);
  void comm(std::string_view parameters, MonotonicTime now, Answer& answer);
  void ver(std::string_view parameters, MonotonicTime now, Answer& answer);
  void apirev(std::string_view parameters, MonotonicTime now, Answer& answer);
  void beep(std::string_view parameters, MonotonicTime now, Answer& answer);
  void sflist(std::string_view parameters, MonotonicTime now, Answer& answer);
  void get(std::string_view parameters, MonotonicTime now, Answer& answer);
  void getinfo(std::string_view parameters, MonotonicTime now, Answer& answer);
  void echo(std::string_view parameters, MonotonicTime now, Answer& answer);
  void phsr(std::string_view parameters, MonotonicTime now, Answer& answer);
  void phinf(std::string_view parameters, MonotonicTime now, Answer& answer);
  void pinit(std::string_view parameters, MonotonicTime now, Answer& answer);
  void pena(std::string_view parameters, MonotonicTime now, Answer& answer);
  void pdis(std::string_view parameters, MonotonicTime now, Answer& answer);
  void phf(std::string_view parameters, MonotonicTime now, Answer& answer);
  void pvwr(std::string_view parameters, MonotonicTime now, Answer& answer);
  void phrq(std::string_view parameters, MonotonicTime now, Answer& answer);
  void tstart(std::string_view parameters, MonotonicTime now, Answer& answer);
  void tstop(std::string_view parameters, MonotonicTime now, Answer& answer);
  void tx(std::string_view parameters, MonotonicTime now, Answer& answer);
  void bx(std::string_view parameters, MonotonicTime now, Answer& answer);

  /// Every handle is new; INIT also acknowledges that hardware has changed.
  void begin_setup();
  /// The newest measurement of every handle that there is; false with an error when `parameters` are wrong.
  bool report(std::string_view parameters, MonotonicTime now, Answer& answer);
  [[nodiscard]] HandleReading reading_of(const PortHandle& handle, const Measurement* newest) const;

  DeviceSettings settings_;
  Measurements& measurements_;
  SystemConditions& conditions_;
  PortHandles ports_;
  bool initialised_ = false;
  TrackingReply tracking_reply_;
};

}  // namespace tubed::aurora::emulator
