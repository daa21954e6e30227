#include "drivers/laboratory/aurora_emulator/tracker.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/reply.hpp"
#include "drivers/aurora/tx_reply.hpp"
#include "drivers/laboratory/aurora_emulator/identity.hpp"
#include "drivers/laboratory/aurora_emulator/tool_text.hpp"

namespace tubed::aurora::emulator {

namespace {

/// In which state of the tracker a command is taken.
enum class When { kAlways, kSetup, kInitialised, kTracking, kNotTracking };

constexpr std::size_t kMaxCommand = 1024;
constexpr std::size_t kCheckSumAndEnd = 5;  // of a reply in characters
constexpr unsigned kHardwareChanged = 1U << 10;

void say(Answer& answer, std::string_view payload) {
  answer.reply.resize(payload.size() + kCheckSumAndEnd);
  answer.reply.resize(encode_text_reply(payload, answer.reply));
}

void say(Answer& answer, Error error) {
  if (error == Error::kNone) {
    say(answer, "OKAY");
  } else {
    say(answer, "ERROR" + hex(static_cast<std::uint32_t>(error), 2));
  }
}

void say(Answer& answer, const Said& said) {
  if (said.error == Error::kNone) {
    say(answer, said.payload);
  } else {
    say(answer, said.error);
  }
}

/// A number of PHRQ, which may be asterisks: nothing then. False when it is neither.
bool take_wanted(std::string_view digits, std::optional<int>& wanted) {
  if (digits == "**") {
    return true;
  }
  const auto number = parse_hex(digits);
  wanted = number ? std::optional(static_cast<int>(*number)) : std::nullopt;
  return number.has_value();
}

/// The value of exactly `digits` hexadecimal digits.
std::optional<std::uint32_t> exact_hex(std::string_view text, std::size_t digits) {
  return text.size() == digits ? parse_hex(text) : std::nullopt;
}

std::optional<std::uint8_t> handle_number(std::string_view text) {
  const auto number = exact_hex(text, 2);
  return number ? std::optional(static_cast<std::uint8_t>(*number)) : std::nullopt;
}

std::string upper_case(std::string_view text) {
  std::string upper(text);
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return upper;
}

}  // namespace

struct Tracker::Rule {
  std::string_view name;
  When when;
  void (Tracker::*run)(std::string_view parameters, MonotonicTime now, Answer& answer);
};

const Tracker::Rule* Tracker::find_rule(std::string_view name) {
  static constexpr std::array kRules = {
      Rule{"BX", When::kTracking, &Tracker::bx},        Rule{"TX", When::kTracking, &Tracker::tx},
      Rule{"TSTOP", When::kTracking, &Tracker::tstop},  Rule{"TSTART", When::kSetup, &Tracker::tstart},
      Rule{"PHSR", When::kSetup, &Tracker::phsr},       Rule{"PINIT", When::kSetup, &Tracker::pinit},
      Rule{"PENA", When::kSetup, &Tracker::pena},       Rule{"PDIS", When::kSetup, &Tracker::pdis},
      Rule{"PHF", When::kSetup, &Tracker::phf},         Rule{"PVWR", When::kSetup, &Tracker::pvwr},
      Rule{"PHRQ", When::kSetup, &Tracker::phrq},       Rule{"PHINF", When::kInitialised, &Tracker::phinf},
      Rule{"INIT", When::kNotTracking, &Tracker::init}, Rule{"COMM", When::kAlways, &Tracker::comm},
      Rule{"VER", When::kAlways, &Tracker::ver},        Rule{"APIREV", When::kAlways, &Tracker::apirev},
      Rule{"BEEP", When::kAlways, &Tracker::beep},      Rule{"SFLIST", When::kAlways, &Tracker::sflist},
      Rule{"GET", When::kAlways, &Tracker::get},        Rule{"GETINFO", When::kAlways, &Tracker::getinfo},
      Rule{"ECHO", When::kAlways, &Tracker::echo},      Rule{"RESET", When::kAlways, &Tracker::reset},
  };
  const auto* const found =
      std::find_if(kRules.begin(), kRules.end(), [name](const Rule& rule) { return rule.name == name; });
  return found == kRules.end() ? nullptr : &*found;
}

Tracker::Tracker(const DeviceSettings& settings, Measurements& measurements, SystemConditions& conditions)
    : settings_(settings), measurements_(measurements), conditions_(conditions), ports_(settings.plugs) {}

void Tracker::start_anew(MonotonicTime now) {
  initialised_ = false;
  measurements_.power_on(now);
  ports_.forget_descriptions();
  begin_setup();
}

void Tracker::begin_setup() {
  ports_.start_anew();
  if (conditions_.field_generator_present) {
    conditions_.raised.bits &= static_cast<std::uint16_t>(~kHardwareChanged);
  }
}

Answer Tracker::execute(std::string_view line, MonotonicTime now) {
  Answer answer;
  answer.thinking = settings_.durations.other;
  if (line.size() > kMaxCommand) {
    say(answer, Error::kTooLong);
    return answer;
  }
  const auto command = parse_command(line);
  const Rule* rule = command ? find_rule(upper_case(command->name)) : nullptr;
  if (command && !command->crc_matches) {
    say(answer, Error::kCrc);
  } else if (rule == nullptr) {
    say(answer, Error::kUnknownCommand);
  } else if (const Error refused = refusal(*rule); refused != Error::kNone) {
    say(answer, refused);
  } else {
    (this->*rule->run)(command->parameters, now, answer);
  }
  return answer;
}

Error Tracker::refusal(const Rule& rule) const {
  const bool needs_init = rule.when != When::kAlways && rule.when != When::kNotTracking;
  if (needs_init && !initialised_) {
    return Error::kSystemNotInitialised;
  }
  const bool needs_tracking = rule.when == When::kTracking;
  const bool forbids_tracking = rule.when == When::kSetup || rule.when == When::kNotTracking;
  const bool tracking = measurements_.tracking();
  return (needs_tracking && !tracking) || (forbids_tracking && tracking) ? Error::kMode : Error::kNone;
}

void Tracker::reset(std::string_view, MonotonicTime, Answer& answer) { answer.starts_anew = true; }

void Tracker::init(std::string_view, MonotonicTime now, Answer& answer) {
  initialised_ = true;
  measurements_.begin_count(now);
  begin_setup();
  answer.thinking = settings_.durations.init;
  say(answer, Error::kNone);
}

void Tracker::comm(std::string_view parameters, MonotonicTime, Answer& answer) {
  const auto link = parse_link_parameters(parameters);
  const bool fast = link && (link->rate == BaudRate::k230400 || link->rate == BaudRate::k921600 ||
                             link->rate == BaudRate::k1228739);
  if (!link || (fast && !settings_.firmware.takes_fast_rates)) {
    say(answer, parameters.size() == 5 ? Error::kLinkRefused : Error::kParameters);
    return;
  }
  answer.link = link;
  say(answer, Error::kNone);
}

void Tracker::ver(std::string_view parameters, MonotonicTime, Answer& answer) {
  say(answer, version_text(parameters, settings_));
}

void Tracker::apirev(std::string_view, MonotonicTime, Answer& answer) {
  say(answer, settings_.firmware.api_revision);
}

void Tracker::echo(std::string_view parameters, MonotonicTime, Answer& answer) {
  if (parameters.empty()) {
    say(answer, Error::kParameters);
  } else {
    say(answer, parameters);
  }
}

void Tracker::beep(std::string_view parameters, MonotonicTime, Answer& answer) {
  const auto times = exact_hex(parameters, 1);
  if (!times || *times < 1 || *times > 9) {
    say(answer, times ? Error::kOutOfRange : Error::kParameters);
  } else {
    say(answer, "1");
  }
}

void Tracker::sflist(std::string_view parameters, MonotonicTime, Answer& answer) {
  say(answer, feature_text(parameters));
}

void Tracker::get(std::string_view parameters, MonotonicTime, Answer& answer) {
  say(answer, user_parameter(parameters, settings_.firmware));
}

void Tracker::getinfo(std::string_view parameters, MonotonicTime, Answer& answer) {
  say(answer, user_parameter_info(parameters, settings_.firmware));
}

void Tracker::phsr(std::string_view parameters, MonotonicTime, Answer& answer) {
  const auto query = exact_hex(parameters, 2);
  if (!query || *query > static_cast<std::uint32_t>(HandleQuery::kEnabled)) {
    say(answer, query ? Error::kOutOfRange : Error::kParameters);
    return;
  }
  say(answer, handle_list_text(ports_.list(static_cast<HandleQuery>(*query))));
}

void Tracker::phinf(std::string_view parameters, MonotonicTime, Answer& answer) {
  if (measurements_.tracking() && settings_.phinf_while_tracking == PhinfWhileTracking::kRefused) {
    say(answer, Error::kMode);
    return;
  }
  const auto number = handle_number(parameters.substr(0, 2));
  const auto fields = parameters.size() == 2
                          ? std::optional(1U)
                          : exact_hex(parameters.substr(std::min<std::size_t>(2, parameters.size())), 4);
  if (!number || !fields) {
    say(answer, Error::kParameters);
    return;
  }
  const PortHandle* handle = ports_.find(*number);
  if (handle == nullptr) {
    say(answer, Error::kHandle);
  } else if ((*fields & ~0x003FU) != 0 || *fields == 0) {
    say(answer, Error::kOutOfRange);
  } else {
    say(answer, tool_text(*handle, ports_.plug(*handle), *fields));
  }
}

void Tracker::pinit(std::string_view parameters, MonotonicTime, Answer& answer) {
  const auto number = handle_number(parameters);
  const Error error = number ? ports_.initialise(*number) : Error::kParameters;
  if (error == Error::kNone || error == Error::kCannotInitialise) {
    answer.thinking = settings_.durations.pinit;
  }
  say(answer, error);
}

void Tracker::pena(std::string_view parameters, MonotonicTime, Answer& answer) {
  const auto number = handle_number(parameters.substr(0, 2));
  if (!number || parameters.size() != 3) {
    say(answer, Error::kParameters);
  } else if (std::string_view("SDB").find(parameters[2]) == std::string_view::npos) {
    say(answer, Error::kPriority);
  } else {
    say(answer, ports_.enable(*number));
  }
}

void Tracker::pdis(std::string_view parameters, MonotonicTime, Answer& answer) {
  const auto number = handle_number(parameters);
  say(answer, number ? ports_.disable(*number) : Error::kParameters);
}

void Tracker::phf(std::string_view parameters, MonotonicTime, Answer& answer) {
  const auto number = handle_number(parameters);
  say(answer, number ? ports_.free(*number) : Error::kParameters);
}

void Tracker::pvwr(std::string_view parameters, MonotonicTime, Answer& answer) {
  constexpr std::size_t kSize = 2 + 4 + 2 * kToolMemoryBlock;
  const auto is_digit = [](unsigned char c) { return std::isxdigit(c) != 0; };
  if (parameters.size() != kSize || !std::all_of(parameters.begin(), parameters.end(), is_digit)) {
    say(answer, Error::kParameters);
    return;
  }
  std::array<std::uint8_t, kToolMemoryBlock> block{};
  for (std::size_t i = 0; i < block.size(); ++i) {
    block[i] = static_cast<std::uint8_t>(*parse_hex(parameters.substr(6 + 2 * i, 2)));
  }
  answer.thinking = settings_.durations.pvwr;
  say(answer,
      ports_.write(*handle_number(parameters.substr(0, 2)), *parse_hex(parameters.substr(2, 4)), block));
}

/// Device (8), system (1), tool (1), port (2), channel (2). There is one device, system and tool.
void Tracker::phrq(std::string_view parameters, MonotonicTime, Answer& answer) {
  PortRequest request;
  if (parameters.size() != 14 || !take_wanted(parameters.substr(10, 2), request.port) ||
      !take_wanted(parameters.substr(12, 2), request.channel)) {
    say(answer, Error::kParameters);
    return;
  }
  std::uint8_t number = 0;
  if (const Error error = ports_.request(request, number); error != Error::kNone) {
    say(answer, error);
  } else {
    say(answer, hex(number, 2));
  }
}

void Tracker::tstart(std::string_view parameters, MonotonicTime now, Answer& answer) {
  const auto option = parameters.empty() ? std::optional(0U) : exact_hex(parameters, 2);
  constexpr std::uint32_t kCountAnew = 0x80;
  constexpr std::uint32_t kFaster = 0x40;
  if (!option || (*option & ~(kCountAnew | kFaster)) != 0) {
    say(answer, option ? Error::kOutOfRange : Error::kParameters);
    return;
  }
  answer.thinking = settings_.durations.tstart;
  if ((*option & kCountAnew) != 0) {
    measurements_.count_anew(now + answer.thinking);
  }
  ports_.begin_tracking();
  measurements_.start(now + answer.thinking);
  say(answer, Error::kNone);
}

void Tracker::tstop(std::string_view, MonotonicTime now, Answer& answer) {
  measurements_.newest(now);
  measurements_.stop();
  answer.thinking = settings_.durations.tstop;
  say(answer, Error::kNone);
}

bool Tracker::report(std::string_view parameters, MonotonicTime now, Answer& answer) {
  const auto options =
      parameters.empty() ? std::optional<std::uint32_t>(kTransforms) : exact_hex(parameters, 4);
  if (!options || (*options & ~static_cast<std::uint32_t>(kTransforms | kAlsoOutOfVolume)) != 0 ||
      (*options & kTransforms) == 0) {
    say(answer, options ? Error::kOutOfRange : Error::kParameters);
    return false;
  }
  const bool also_outside = (*options & kAlsoOutOfVolume) != 0;
  const Measurement* newest = measurements_.newest(now);
  tracking_reply_.handle_count = 0;
  tracking_reply_.system_status.bits = static_cast<std::uint16_t>(ports_.news.bits | conditions_.raised.bits);
  for (const PortHandle& handle : ports_.all()) {
    HandleReading& reading =
        tracking_reply_.handles[static_cast<std::size_t>(tracking_reply_.handle_count++)];
    reading = reading_of(handle, newest);
    if (!also_outside && reading.port_status.out_of_volume()) {
      reading = {0, Report::kMissing, {}, {}, 0, reading.port_status, reading.frame};
    }
    reading.handle = handle.number;
  }
  answer.thinking = settings_.durations.tracking;
  answer.has_tracking_data = true;
  return true;
}

HandleReading Tracker::reading_of(const PortHandle& handle, const Measurement* newest) const {
  HandleReading reading;
  if (handle.stale || !handle.enabled) {
    reading.report = handle.report_without_data();
    return reading;
  }
  const int sensor = ports_.plug(handle).sensors[static_cast<std::size_t>(handle.channel)];
  if (newest != nullptr) {
    reading.frame = newest->frame;
    if (sensor >= 1 && sensor <= kMaxTrackerCoils) {
      reading = newest->coils[static_cast<std::size_t>(sensor - 1)];
    }
  }
  reading.port_status.bits |= handle.status().bits;
  return reading;
}

void Tracker::tx(std::string_view parameters, MonotonicTime now, Answer& answer) {
  if (report(parameters, now, answer)) {
    std::array<std::uint8_t, kMaxHandles * 73 + 8> payload{};
    const std::size_t size = encode_tx(tracking_reply_, payload);
    say(answer, as_text(Bytes(payload).first(size)));
  }
}

void Tracker::bx(std::string_view parameters, MonotonicTime now, Answer& answer) {
  if (!settings_.firmware.knows_bx) {
    say(answer, Error::kUnknownCommand);
  } else if (report(parameters, now, answer)) {
    answer.reply.resize(kMaxBxFrame);
    answer.reply.resize(encode_bx(tracking_reply_, answer.reply));
  }
}

}  // namespace tubed::aurora::emulator
