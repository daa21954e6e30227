#include "tests/second_aurora/interpreter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tests/second_aurora/handle_commands.hpp"
#include "tests/second_aurora/inquiries.hpp"
#include "tests/second_aurora/replies.hpp"

namespace tubed::second_aurora {

namespace {

constexpr std::uint16_t kPortOccupied = 1u << 6, kPortUnoccupied = 1u << 7, kHardwareChanged = 1u << 10;

}  // namespace

Interpreter::Interpreter(const Settings& settings, Field& field, Mischief& mischief)
    : settings_(settings), field_(field), mischief_(mischief), ports_(settings) {}

void Interpreter::reset() {
  mode_ = Mode::Fresh;
  ports_.forget_handles();
  plug_status_ = 0;
  beeping_until_ns_ = INT64_MIN;
}

const Interpreter::Entry* Interpreter::entry_of(std::string_view name) {
  static constexpr std::pair<std::string_view, Entry> kCommands[] = {
      {"INIT", {[](Interpreter& i, std::string_view p) { return i.init(p); }, true, true, false}},
      {"COMM", {[](Interpreter& i, std::string_view p) { return i.comm(p); }, true, true, false}},
      {"VER", {[](Interpreter& i, std::string_view p) { return i.ver(p); }, true, true, true}},
      {"APIREV", {[](Interpreter& i, std::string_view p) { return i.apirev(p); }, true, true, true}},
      {"SFLIST", {[](Interpreter& i, std::string_view p) { return i.sflist(p); }, true, true, true}},
      {"GETINFO", {[](Interpreter& i, std::string_view p) { return i.getinfo(p); }, true, true, true}},
      {"GET", {[](Interpreter& i, std::string_view p) { return i.get(p); }, true, true, true}},
      {"ECHO", {[](Interpreter& i, std::string_view p) { return i.echo(p); }, true, true, true}},
      {"BEEP", {[](Interpreter& i, std::string_view p) { return i.beep(p); }, true, true, true}},
      {"PHSR", {[](Interpreter& i, std::string_view p) { return i.phsr(p); }, false, true, false}},
      {"PHRQ",
       {[](Interpreter& i, std::string_view p) { return second_aurora::phrq(i.settings_, i.ports_, p); },
        false, true, false}},
      {"PHF",
       {[](Interpreter& i, std::string_view p) { return second_aurora::phf(i.ports_, p); }, false, true,
        false}},
      {"PINIT",
       {[](Interpreter& i, std::string_view p) { return second_aurora::pinit(i.ports_, p); }, false, true,
        false}},
      {"PENA",
       {[](Interpreter& i, std::string_view p) { return second_aurora::pena(i.ports_, p); }, false, true,
        false}},
      {"PDIS",
       {[](Interpreter& i, std::string_view p) { return second_aurora::pdis(i.ports_, p); }, false, true,
        false}},
      {"PHINF",
       {[](Interpreter& i, std::string_view p) { return second_aurora::phinf(i.settings_, i.ports_, p); },
        false, true, true}},
      {"PVWR",
       {[](Interpreter& i, std::string_view p) { return second_aurora::pvwr(i.ports_, p); }, false, true,
        false}},
      {"TSTART", {[](Interpreter& i, std::string_view p) { return i.tstart(p); }, false, true, false}},
      {"TSTOP", {[](Interpreter& i, std::string_view p) { return i.tstop(p); }, false, false, true}},
  };
  for (const auto& [known, entry] : kCommands) {
    if (known == name) {
      return &entry;
    }
  }
  return nullptr;
}

std::int64_t Interpreter::duration_ns(const CommandLine& command) {
  const Timing& timing = settings_.timing;
  if (command.error != 0) {
    return timing.other_ns;
  }
  if (command.name == "TX" || command.name == "BX") {
    return timing.tracking_reply_ns;
  }
  if (command.name == "INIT") {
    return timing.init_ns;
  }
  if (command.name == "PVWR") {
    return timing.pvwr_ns;
  }
  if (command.name == "TSTOP" && mode_ == Mode::Tracking) {
    return timing.tstop_ns;
  }
  if (command.name == "TSTART" && mode_ == Mode::Setup) {
    return timing.tstart_min_ns +
           std::llround(static_cast<double>(timing.tstart_max_ns - timing.tstart_min_ns) *
                        mischief_.uniform());
  }
  if (command.name == "PINIT" && mode_ == Mode::Setup) {
    std::string wrong;
    const Handle* handle = handle_in(ports_, command.parameters, wrong);
    if (handle != nullptr && handle->occupied) {
      return handle->initialised || handle->rom_is_written() ? timing.pinit_virtual_ns : timing.pinit_rom_ns;
    }
  }
  return timing.other_ns;
}

int Interpreter::mode_error(const Entry& entry, std::string_view name) const {
  if (mode_ == Mode::Fresh && !entry.when_fresh) {
    return name == "TSTOP" ? 0x0C : 0x10;
  }
  if (name == "PHINF" && mode_ == Mode::Tracking) {
    return settings_.firmware.phinf_answers_while_tracking ? 0 : 0x0C;
  }
  const bool allowed = mode_ == Mode::Fresh   ? entry.when_fresh
                       : mode_ == Mode::Setup ? entry.in_setup
                                              : entry.in_tracking;
  return allowed ? 0 : 0x0C;
}

Answer Interpreter::answer(const CommandLine& command, std::int64_t now_ns) {
  now_ns_ = now_ns;
  Answer answer;
  if (command.error != 0) {
    answer.bytes = framed(error_text(command.error));
    return answer;
  }
  if (command.name == "TX" || command.name == "BX") {
    return tracking_answer(command.parameters, now_ns, command.name == "BX");
  }
  if (command.name == "RESET") {
    answer.resets = true;
    return answer;
  }
  const Entry* entry = entry_of(command.name);
  if (entry == nullptr) {
    answer.bytes = framed(error_text(0x01));
    return answer;
  }
  const int refused = mode_error(*entry, command.name);
  const std::string payload = refused != 0 ? error_text(refused) : entry->action(*this, command.parameters);
  if (command.name == "COMM" && payload == "OKAY") {
    static constexpr int kRates[] = {9600, 14400, 19200, 38400, 57600, 115200, 921600, 1228739, 0, 0, 230400};
    answer.rate = kRates[*from_hex(command.parameters.substr(0, 1))];
  }
  answer.bytes = framed(payload);
  return answer;
}

Answer Interpreter::answer_in_text(const CommandLine& command, std::int64_t now_ns) {
  return tracking_answer(command.parameters, now_ns, false);
}

Answer Interpreter::tracking_answer(std::string_view parameters, std::int64_t now_ns, bool binary) {
  Answer answer;
  const auto refuse = [&answer](int number) {
    answer.bytes = framed(error_text(number));
    return answer;
  };
  if (binary && settings_.firmware.bx_error) {
    return refuse(*settings_.firmware.bx_error);
  }
  if (mode_ != Mode::Tracking) {
    return refuse(0x0C);
  }
  const auto options = parameters.empty() ? 0x0001u : from_hex(parameters);
  if (!options || (!parameters.empty() && parameters.size() != 4)) {
    return refuse(0x07);
  }
  if ((*options & ~0x0801u) != 0) {
    return refuse(0x23);
  }
  TrackingReply reply;
  reply.handles = ordered(ports_.list(HandleQuery::All));
  reply.measurement =
      replied_since_start_ || !settings_.firmware.first_reply_is_missing ? field_.newest(now_ns) : nullptr;
  replied_since_start_ = true;
  reply.reports_out_of_volume = (*options & 0x0800) != 0;
  reply.extra_port_status = settings_.firmware.extra_port_status;
  reply.system_status = system_status();
  answer.bytes = binary ? in_binary(reply) : framed(in_text(reply));
  answer.kind.tracking = true;
  answer.kind.binary = binary;
  return answer;
}

std::vector<const Handle*> Interpreter::ordered(std::vector<const Handle*> handles) {
  switch (settings_.firmware.handle_order) {
    case HandleOrder::Ascending:
      break;
    case HandleOrder::Descending:
      std::reverse(handles.begin(), handles.end());
      break;
    case HandleOrder::ShuffledEachReply:
      for (std::size_t i = handles.size(); i > 1; --i) {
        std::swap(handles[i - 1], handles[mischief_.below(i)]);
      }
      break;
  }
  return handles;
}

std::uint16_t Interpreter::system_status() const {
  return static_cast<std::uint16_t>(plug_status_ | raised_status_ |
                                    (field_.generator_plugged() ? 0 : kHardwareChanged));
}

void Interpreter::plug(int port, const Tool& tool) {
  ports_.plug(port, tool);
  plug_status_ |= kPortOccupied;
  if (mode_ == Mode::Setup ||
      (mode_ == Mode::Tracking && settings_.firmware.plug_gets_handle_while_tracking)) {
    ports_.allocate_missing();
  }
}

void Interpreter::unplug(int port) {
  ports_.unplug(port, mode_ == Mode::Tracking);
  plug_status_ |= kPortUnoccupied;
}

std::string Interpreter::init(std::string_view) {
  if (mode_ == Mode::Fresh) {
    plug_status_ = 0;
  } else if (settings_.firmware.init_frees_handles) {
    ports_.forget_handles();
  }
  ports_.allocate_missing();
  mode_ = Mode::Setup;
  return "OKAY";
}

std::string Interpreter::comm(std::string_view parameters) {
  if (parameters.size() != 5) {
    return error_text(0x07);
  }
  const char rate = parameters[0];
  const bool known = (rate >= '0' && rate <= '7') || rate == 'A';
  const bool refused = settings_.firmware.refused_rates.find(rate) != std::string::npos;
  // Only 8 data bits, no parity and 1 stop bit are emulated.
  const bool framing = parameters.substr(1, 3) == "000" && (parameters[4] == '0' || parameters[4] == '1');
  return known && !refused && framing ? "OKAY" : error_text(0x06);
}

std::string Interpreter::ver(std::string_view parameters) {
  return version_text(settings_.firmware, parameters).value_or(error_text(0x23));
}

std::string Interpreter::apirev(std::string_view) { return settings_.firmware.api_revision; }

std::string Interpreter::sflist(std::string_view parameters) {
  return feature_text(parameters).value_or(error_text(0x25));
}

std::string Interpreter::getinfo(std::string_view parameters) {
  if (settings_.firmware.getinfo_error) {
    return error_text(*settings_.firmware.getinfo_error);
  }
  return get(parameters);
}

std::string Interpreter::get(std::string_view parameters) {
  return user_parameter(settings_.firmware, parameters).value_or(error_text(0x34));
}

std::string Interpreter::echo(std::string_view parameters) { return std::string(parameters); }

std::string Interpreter::beep(std::string_view parameters) {
  if (parameters.size() != 1 || parameters[0] < '1' || parameters[0] > '9') {
    return error_text(0x23);
  }
  if (now_ns_ < beeping_until_ns_) {
    return "0";
  }
  beeping_until_ns_ = now_ns_ + (parameters[0] - '0') * 400 * kMillisecond_ns;
  return "1";
}

std::string Interpreter::phsr(std::string_view parameters) {
  const auto query = parameters.empty() ? 0u : from_hex(parameters);
  if (!query || *query > 4) {
    return error_text(0x23);
  }
  const auto handles = ordered(ports_.list(static_cast<HandleQuery>(*query)));
  std::string text = hex(handles.size(), 2);
  for (const Handle* handle : handles) {
    text += hex(static_cast<unsigned>(handle->number), 2) +
            hex(static_cast<unsigned>(ports_.status_of(*handle)), 3);
  }
  plug_status_ = 0;
  return text;
}

std::string Interpreter::tstart(std::string_view parameters) {
  if (!parameters.empty() && parameters != "40" && parameters != "80" && parameters != "C0" &&
      parameters != "c0") {
    return error_text(0x23);
  }
  if (!field_.generator_plugged()) {
    return error_text(0x12);
  }
  mode_ = Mode::Tracking;
  replied_since_start_ = false;
  ports_.tracking_starts();
  field_.tracking_starts(!parameters.empty() && parameters != "40");
  return "OKAY";
}

std::string Interpreter::tstop(std::string_view) {
  mode_ = Mode::Setup;
  ports_.allocate_missing();
  return "OKAY";
}

}  // namespace tubed::second_aurora
