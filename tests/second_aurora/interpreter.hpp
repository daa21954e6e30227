// What each command does and answers, without time on the wire and without faults of replies.
// Used by SecondAurora only, in its thread.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tests/second_aurora/command_line.hpp"
#include "tests/second_aurora/field.hpp"
#include "tests/second_aurora/mischief.hpp"
#include "tests/second_aurora/port_table.hpp"
#include "tests/second_aurora/settings.hpp"

namespace tubed::second_aurora {

struct Answer {
  Bytes bytes;
  ReplyKind kind;
  int rate = 0;         // COMM: bit rate from the end of this reply on; 0: stays
  bool resets = false;  // RESET: no reply but the one of the reset
};

class Interpreter {
 public:
  // Settings, field and mischief are kept by reference and outlive the interpreter.
  Interpreter(const Settings& settings, Field& field, Mischief& mischief);

  // Reset or power on: neither initialised nor tracking, no handles.
  void reset();
  // How long the device works on the command before it answers; drawn anew for TSTART.
  std::int64_t duration_ns(const CommandLine& command);
  // Carries the command out, `now_ns` being the end of its duration.
  Answer answer(const CommandLine& command, std::int64_t now_ns);
  // The tracking reply to `command` in text, whichever of TX and BX it is.
  Answer answer_in_text(const CommandLine& command, std::int64_t now_ns);

  void plug(int port, const Tool& tool);
  void unplug(int port);
  void raise_status(std::uint16_t bits) {
    raised_status_ = static_cast<std::uint16_t>(raised_status_ | bits);
  }
  void clear_status(std::uint16_t bits) {
    raised_status_ = static_cast<std::uint16_t>(raised_status_ & ~bits);
  }
  bool tracking() const { return mode_ == Mode::Tracking; }
  const PortTable& ports() const { return ports_; }

 private:
  enum class Mode { Fresh, Setup, Tracking };
  using Action = std::string (*)(Interpreter&, std::string_view parameters);
  struct Entry {
    Action action;
    bool when_fresh, in_setup, in_tracking;
  };
  static const Entry* entry_of(std::string_view name);

  int mode_error(const Entry& entry, std::string_view name) const;
  Answer tracking_answer(std::string_view parameters, std::int64_t now_ns, bool binary);
  std::vector<const Handle*> ordered(std::vector<const Handle*> handles);
  std::uint16_t system_status() const;

  std::string init(std::string_view parameters);
  std::string comm(std::string_view parameters);
  std::string ver(std::string_view parameters);
  std::string apirev(std::string_view parameters);
  std::string sflist(std::string_view parameters);
  std::string getinfo(std::string_view parameters);
  std::string get(std::string_view parameters);
  std::string echo(std::string_view parameters);
  std::string beep(std::string_view parameters);
  std::string phsr(std::string_view parameters);
  std::string tstart(std::string_view parameters);
  std::string tstop(std::string_view parameters);

  const Settings& settings_;
  Field& field_;
  Mischief& mischief_;
  PortTable ports_;
  Mode mode_ = Mode::Fresh;
  bool replied_since_start_ = false;
  std::uint16_t plug_status_ = 0;    // bits 6 and 7, until PHSR asks
  std::uint16_t raised_status_ = 0;  // set from outside
  std::int64_t now_ns_ = 0, beeping_until_ns_ = INT64_MIN;
};

}  // namespace tubed::second_aurora
