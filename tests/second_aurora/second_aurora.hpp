// A second emulated NDI Aurora, written from the protocol alone and sharing no line with the driver or with
// the first emulator: both could share a misunderstanding. README.md says what each behaviour rests on.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tests/second_aurora/field.hpp"
#include "tests/second_aurora/interpreter.hpp"
#include "tests/second_aurora/mischief.hpp"
#include "tests/second_aurora/serial_line.hpp"
#include "tests/second_aurora/settings.hpp"

namespace tubed::second_aurora {

// Bytes in, bytes out. It has no thread, clock or port: every call brings the time in ns of any clock that
// does not run backwards, and hours pass as fast as they are computed. One thread at a time.
class SecondAurora {
 public:
  // Throws std::invalid_argument when settings make no sense. RESETBE6F comes out boot_ns after power_on_ns.
  SecondAurora(const Settings& settings, Motion motion, std::int64_t power_on_ns);
  SecondAurora(const SecondAurora&) = delete;
  SecondAurora& operator=(const SecondAurora&) = delete;

  // Called with every measurement at the next call of any other function after it was taken, oldest first,
  // and before a reply that contains it comes out. Calls nothing of this object.
  std::function<void(const Truth&)> on_measurement;

  // --- the line --- (rates are positive)
  // The host begins to send these bytes now, or when it has sent the ones before.
  void hear(std::span<const std::uint8_t> bytes, int host_baud, std::int64_t now_ns);
  // The host holds the line low instead of sending what it had not sent yet: resets the device at any rate.
  void serial_break(std::int64_t now_ns);
  // Appends what the host could read since the last call. Call it before the host changes its rate.
  void speak(std::int64_t now_ns, int host_baud, std::vector<std::uint8_t>& out);
  // When speak() may have something next; INT64_MAX when only the host can cause something. May be early,
  // never late.
  std::int64_t next_event_ns() const;
  // Is there a serial port to open? Not during hang_up() and while the power is off.
  bool connected(std::int64_t now_ns) const;

  // --- what happens to the device ---
  // The cable is out: bytes both ways are lost, the device goes on with what it does.
  void hang_up(std::int64_t now_ns, std::int64_t duration_ns);
  void power_cycle(std::int64_t now_ns, std::int64_t off_duration_ns);
  // Ports count from 1. Plugging into an occupied port exchanges the tool at one instant.
  void plug(int port, const Tool& tool, std::int64_t now_ns);
  void unplug(int port, std::int64_t now_ns);
  void unplug_field_generator(std::int64_t now_ns);
  void plug_field_generator(std::int64_t now_ns);
  // Bits of the system status in TX and BX: 0 lost synchronisation, 8 diagnostic pending, 9 temperature.
  void raise_system_status(std::uint16_t bits, std::int64_t now_ns);
  void clear_system_status(std::uint16_t bits, std::int64_t now_ns);
  void strike(const Fault& fault, std::int64_t now_ns);
  void strike_no_more(std::int64_t now_ns);

  // --- what to look at ---
  Counts counts() const;
  bool tracking() const { return interpreter_.tracking(); }
  int baud() const { return baud_; }

 private:
  enum class Power { Off, Resetting, On };
  struct Work {
    CommandLine command;
    std::int64_t done_ns = 0;
  };

  void advance(std::int64_t now_ns);
  std::int64_t next_step_ns() const;
  void step(std::int64_t now_ns);
  void power_step(std::int64_t now_ns);
  void byte_arrives();
  void start_work();
  void finish_work();
  void send_reply(const Bytes& reply, const std::optional<Fault>& fault, std::int64_t now_ns);
  void forget_everything(std::int64_t now_ns);
  void reset(std::int64_t now_ns);
  void switch_off(std::int64_t now_ns, std::int64_t duration_ns);
  bool hung_up(std::int64_t now_ns) const { return now_ns >= hung_from_ns_ && now_ns < hung_until_ns_; }
  void check_port(int port) const;

  const Settings settings_;
  Mischief mischief_;
  Field field_;
  Interpreter interpreter_;
  Ear device_ear_, host_ear_;
  LineIn in_;
  LineOut out_;
  Power power_ = Power::Off;
  std::int64_t power_until_ns_;  // end of Off or Resetting
  std::uint32_t first_frame_;    // after the next start
  int baud_ = 9600;
  int next_baud_ = 9600;
  std::int64_t next_baud_at_ns_ = INT64_MAX;
  std::string line_;
  std::deque<std::pair<CommandLine, std::int64_t>> waiting_;  // with the time of the CR
  std::optional<Work> work_;
  std::int64_t busy_until_ns_ = INT64_MIN;
  std::int64_t hung_from_ns_ = INT64_MAX, hung_until_ns_ = INT64_MAX;
  Bytes previous_text_, previous_binary_;
  Counts counts_;
};

}  // namespace tubed::second_aurora
