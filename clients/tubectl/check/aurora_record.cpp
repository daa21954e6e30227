// tubectl aurora-record: talks to a real NDI Aurora for about a minute, writes down everything, and says
// which assumptions of the driver hold on it; or says so of a conversation written down before.
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>

#include "clients/tubectl/check/anonymous_wire_log.hpp"
#include "clients/tubectl/check/aurora_assumptions.hpp"
#include "clients/tubectl/check/aurora_bringup.hpp"
#include "clients/tubectl/verbs.hpp"
#include "drivers/aurora_serial/serial_port.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

volatile std::sig_atomic_t interrupted = 0;  // NOLINT: what a signal handler may touch

struct RecordOptions {
  std::string serial;
  std::string output;
  std::string check;
  double seconds = 20;
  bool interactive = false;
  bool anonymous = false;
  bool as_json = false;
};

int terminal_width() {
  constexpr int kUsualWidth = 80;
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    return size.ws_col;
  }
  const char* const columns = std::getenv("COLUMNS");  // NOLINT: no other thread
  return columns != nullptr && std::atoi(columns) > 0 ? std::atoi(columns) : kUsualWidth;
}

void print_judgement(const aurora::WireLog& log, bool as_json) {
  const WireConversation conversation = read_conversation(log);
  const auto judged = judge_assumptions(conversation);
  const std::string tracker = printable_text(tracker_name(conversation));
  if (as_json) {
    std::cout << assumption_json(judged, tracker) << std::flush;
    return;
  }
  std::cout << tracker << ": " << conversation.turns.size() << " commands in "
            << with_unit(seconds_of(conversation.end), 1, "s") << "\n\n"
            << assumption_table(judged, terminal_width()) << std::flush;
}

int complain(int exit_code, const std::string& what) {
  std::cerr << "tubectl aurora-record: " << what << '\n';
  return exit_code;
}

int check(const RecordOptions& options) {
  std::ifstream file(options.check, std::ios::binary);
  if (!file || std::filesystem::is_directory(options.check)) {
    return complain(kExitUnavailable, options.check + " cannot be read: is that the name of a wire log?");
  }
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto parsed = aurora::parse_wire_log(text);
  if (const auto* const fault = std::get_if<aurora::WireLogFault>(&parsed)) {
    return complain(kExitBadData, options.check + ":" + std::to_string(fault->line) + ": " + fault->why +
                                      ": this is no wire log (drivers/aurora/README.md describes them)");
  }
  print_judgement(std::get<aurora::WireLog>(parsed), options.as_json);
  return kExitOk;
}

std::string utc_time(const char* pattern) {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  std::array<char, 64> text{};
  std::strftime(text.data(), text.size(), pattern, &utc);
  return text.data();
}

/// Whether somebody has pressed Enter since the last call. An input that has ended is not looked at again.
class EnterKey {
 public:
  bool pressed() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    std::array<char, 256> typed{};
    bool is_pressed = false;
    while (is_open_ && ::poll(&input, 1, 0) == 1) {
      is_open_ = ::read(STDIN_FILENO, typed.data(), typed.size()) > 0;
      is_pressed = is_pressed || is_open_;
    }
    return is_pressed;
  }

 private:
  bool is_open_ = true;
};

aurora::WireLog log_of(const aurora::WireTrace& trace, const RecordOptions& options) {
  const std::string device = options.anonymous ? "a serial port" : options.serial;
  const auto parsed = aurora::parse_wire_log(
      aurora::format_wire_trace(trace, "tubectl aurora-record " TUBED_VERSION ", " + device));
  aurora::WireLog log = std::get<aurora::WireLog>(parsed);
  log.header.push_back("recorded " + utc_time("%Y-%m-%d %H:%M:%S UTC"));
  log.header.emplace_back(options.anonymous ? "serial numbers are replaced by zeros"
                                            : "serial numbers of tools and tracker are kept");
  return options.anonymous ? without_serial_numbers(std::move(log)) : log;
}

BringupHooks hooks_for_a_person(EnterKey& enter) {
  const MonotonicTime began = monotonic_now();
  return {[began](std::string_view line) {
            const double time_s = std::chrono::duration<double>(monotonic_now() - began).count();
            std::cerr << with_unit(time_s, 1, "s  ") << printable_text(line) << '\n';
          },
          [] { return interrupted != 0; }, [&enter] { return enter.pressed(); }};
}

int exit_code_of(BringupEnd end, const RecordOptions& options) {
  switch (end) {
    case BringupEnd::kDone:
      return kExitOk;
    case BringupEnd::kInterrupted:
      return complain(kExitOk, "interrupted: the rest was not tried");
    case BringupEnd::kNoTracker:
      return complain(kExitUnavailable, "no answer from the tracker at " + options.serial +
                                            ": is it switched on, and is this its port? If it answered "
                                            "before, switch it off and on");
    case BringupEnd::kPortGone:
      return complain(kExitUnavailable, options.serial + " has gone: was its cable pulled?");
  }
  return kExitFailed;
}

int record(const RecordOptions& options) {
  SerialPort port(options.serial);
  if (const int error = port.open(); error != 0) {
    return complain(kExitUnavailable, options.serial + " " + std::string(describe_open_error(error)));
  }
  const std::string path =
      options.output.empty() ? "aurora-" + utc_time("%Y%m%d-%H%M%S") + ".log" : options.output;
  std::ofstream file(path, std::ios::binary);
  if (!file) {
    return complain(kExitUnavailable, path + " cannot be written: choose another place with --output");
  }
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    std::signal(number, [](int) { interrupted = 1; });
  }
  EnterKey enter;
  BringupSettings settings;
  settings.measuring =
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(options.seconds));
  settings.interactive = options.interactive;
  AuroraBringup bringup(port, settings, hooks_for_a_person(enter));
  const BringupEnd end = bringup.run();
  const aurora::WireLog log = log_of(bringup.trace(), options);
  file << aurora::format_wire_log(log);
  file.close();
  if (!file) {
    return complain(kExitUnavailable, path + " could not be written: is the disk full?");
  }
  print_judgement(log, options.as_json);
  std::cerr << path << " has the whole conversation.\n"
            << (options.anonymous ? "Serial numbers are zeros in it."
                                  : "Serial numbers of tools and tracker are in it (--anonymous leaves "
                                    "them out).")
            << '\n';
  return exit_code_of(end, options);
}

}  // namespace

CommandLine add_aurora_record(CommandLine app, int& exit_code) {
  auto options = std::make_shared<RecordOptions>();
  CommandLine verb = app.add_subcommand(
      "aurora-record",
      "Talk to an NDI Aurora for about a minute, record everything, and say which assumptions of the driver "
      "hold on it; not while tubed runs");
  Argument serial = verb.add_option("--serial", options->serial,
                                    "The tracker's port, as /dev/serial/by-id/usb-NDI_Aurora...");
  Argument check_file = verb.add_option("--check", options->check, "Judge this wire log instead");
  serial.excludes(check_file);
  for (Argument one :
       {verb.add_option("--output", options->output, "The wire log; default: aurora-TIME.log"),
        verb.add_option("--seconds", options->seconds,
                        "How long to measure; everything else takes about 30 s")
            .in_range(0.0, 600.0)
            .capture_default_str(),
        verb.add_flag("--interactive", options->interactive,
                      "Also ask for plugs to be pulled and put in; Enter skips"),
        verb.add_flag("--anonymous", options->anonymous,
                      "Replace serial numbers of tools and tracker by zeros; they are kept otherwise")}) {
    one.needs(serial);
  }
  verb.add_flag("--json", options->as_json, "JSON instead of a table");
  verb.callback([options, &exit_code] {
    if (options->serial.empty() && options->check.empty()) {
      refuse_usage("aurora-record", "name a port with --serial, or a wire log with --check");
    }
    exit_code = options->check.empty() ? record(*options) : check(*options);
  });
  return verb;
}

}  // namespace tubed
