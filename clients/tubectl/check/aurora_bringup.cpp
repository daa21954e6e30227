#include "clients/tubectl/check/aurora_bringup.hpp"

#include <algorithm>
#include <utility>

#include "drivers/aurora/port_replies.hpp"

namespace tubed {

namespace {

using aurora::HandleQuery;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;

/// Every field of PHINF that is known.
constexpr std::uint16_t kToolFields[] = {0x0001, 0x0002, 0x0004, 0x0008, 0x0010, 0x0020};
constexpr std::uint16_t kAlsoOutside = aurora::kTransforms | aurora::kAlsoOutOfVolume;

/// Room for the trace: what one minute of talking needs, and each second of measuring at 115200 baud (11.5 kB
/// in pieces of a millisecond, 16 bytes each besides).
std::size_t trace_capacity(const BringupSettings& settings) {
  constexpr std::size_t kTalking = 8U << 20U;
  constexpr std::size_t kMeasuredSecond = 64U << 10U;
  constexpr int kRequests = 3;
  const nanoseconds waiting = settings.interactive ? kRequests * settings.timeout_of_person : nanoseconds{};
  const auto measured_s = std::chrono::duration_cast<seconds>(settings.measuring + waiting).count();
  return kTalking + static_cast<std::size_t>(std::max<std::int64_t>(measured_s, 0)) * kMeasuredSecond;
}

std::string seconds_text(nanoseconds duration) {
  return std::to_string(std::chrono::duration_cast<seconds>(duration + milliseconds(500)).count()) + " s";
}

}  // namespace

AuroraBringup::AuroraBringup(aurora::ByteChannel& channel, BringupSettings settings, BringupHooks hooks)
    : settings_(settings),
      hooks_(std::move(hooks)),
      talk_(channel, trace_capacity(settings), hooks_.interrupted) {}

BringupEnd AuroraBringup::run() {
  BringupEnd end = BringupEnd::kDone;
  try {
    run_steps();
  } catch (const BringupStopped& stopped) {
    end = stopped.why;
  }
  try {
    put_back();
  } catch (const BringupStopped& stopped) {
    end = stopped.why;
  }
  return end;
}

void AuroraBringup::run_steps() {
  find_tracker();
  break_on_purpose();
  ask_versions();
  try_rates();
  set_up_ports();
  measure_with_a_handle_disabled();
  measure();
  commands_while_tracking();
  commands_during_replies();
  pause_tracking();
  count_anew();
  if (settings_.interactive) {
    ask_person();
  }
  init_while_tracking();
}

void AuroraBringup::step(std::string_view what) {
  talk_.note("step: " + std::string(what));
  hooks_.progress(what);
}

void AuroraBringup::find_tracker() {
  step("looking for the tracker: 9600 baud, 115200 baud, a break, every rate");
  found_ = talk_.find_rate();
  if (!found_) {
    throw BringupStopped{BringupEnd::kNoTracker};
  }
  hooks_.progress("it answers at " + std::to_string(talk_.baud()) + " baud");
}

void AuroraBringup::break_on_purpose() {
  step("serial break, RESET is expected within 2.5 s");
  if (!talk_.send_break()) {
    hooks_.progress("no RESET came: adapter or port swallow the break");
  }
  if (!talk_.ask(aurora::init_command()).okay() && !talk_.find_rate()) {
    throw BringupStopped{BringupEnd::kNoTracker};
  }
}

void AuroraBringup::ask_versions() {
  step("versions, features, time-outs");
  std::string firmware;
  talk_.ask(aurora::apirev_command());
  talk_.ask(aurora::without_crc("APIREV", ""));
  for (const int item : {0, 4, 5, 7, 8}) {
    const Answer answer = talk_.ask(aurora::ver_command(item));
    if (const auto name = aurora::find_firmware(answer.payload)) {
      firmware = *name;
    }
  }
  for (const char* const item : {"00", "03", "10", "12"}) {
    talk_.ask(aurora::with_crc("SFLIST", item));
  }
  talk_.ask(aurora::with_crc("GETINFO", "Features.Firmware.Version"));
  talk_.ask(aurora::with_crc("ECHO", "tubed"));
  for (const char* const command : {"INIT", "PINIT", "TSTART", "TSTOP", "COMM", "VER", "BX"}) {
    talk_.ask(aurora::get_command(std::string("Info.Timeout.") + command));
  }
  hooks_.progress("firmware: " + (firmware.empty() ? "not said" : firmware));
}

void AuroraBringup::try_rates() {
  step("rates: 115200, then 230400 and 921600 and back");
  const bool fast = talk_.change_rate(aurora::BaudRate::k115200);
  for (const aurora::BaudRate rate : {aurora::BaudRate::k230400, aurora::BaudRate::k921600}) {
    const std::string name = std::to_string(aurora::bits_per_second(rate)) + " baud: ";
    const bool works = talk_.change_rate(rate);
    hooks_.progress(name + (works ? "works" : "does not work"));
    if (works || talk_.baud() != aurora::bits_per_second(aurora::BaudRate::k115200)) {
      talk_.change_rate(fast ? aurora::BaudRate::k115200 : aurora::BaudRate::k9600);
    }
  }
  talk_.ask(aurora::init_command());
}

AuroraBringup::Handles AuroraBringup::list(HandleQuery query) {
  Handles handles;
  if (const auto listed = aurora::parse_handle_list(talk_.ask(aurora::phsr_command(query)).payload)) {
    for (const aurora::HandleStatus& entry : listed->entries()) {
      handles.push_back(entry.handle);
    }
  }
  return handles;
}

void AuroraBringup::describe_handles(const Handles& handles) {
  for (const std::uint8_t handle : handles) {
    for (const std::uint16_t field : kToolFields) {
      talk_.ask(aurora::phinf_command(handle, field));
    }
  }
}

void AuroraBringup::free_stale_handles() {
  for (const std::uint8_t handle : list(HandleQuery::kToBeFreed)) {
    talk_.ask(aurora::phf_command(handle));
    failed_.erase(handle);
  }
}

void AuroraBringup::initialise_ports() {
  constexpr int kMaxRounds = 4;
  bool is_done = false;
  for (int round = 0; round < kMaxRounds && !is_done; ++round) {
    is_done = true;
    for (const std::uint8_t handle : list(HandleQuery::kToBeInitialised)) {
      if (failed_.contains(handle)) {
        continue;
      }
      is_done = false;
      if (!talk_.ask(aurora::pinit_command(handle)).okay()) {
        failed_.insert(handle);
      }
    }
  }
}

void AuroraBringup::set_up_ports() {
  step("ports: PHSR, PHINF before and after PINIT");
  free_stale_handles();
  for (const HandleQuery query :
       {HandleQuery::kToBeInitialised, HandleQuery::kToBeEnabled, HandleQuery::kEnabled}) {
    list(query);
  }
  describe_handles(list(HandleQuery::kAll));
  initialise_ports();
  handles_ = list(HandleQuery::kToBeEnabled);
  describe_handles(list(HandleQuery::kAll));
  hooks_.progress(std::to_string(handles_.size()) + " coils are initialised, " +
                  std::to_string(failed_.size()) + " tools could not be" +
                  (handles_.empty() ? ": is a tool plugged in?" : ""));
}

void AuroraBringup::enable(const Handles& handles) {
  for (const std::uint8_t handle : handles) {
    talk_.ask(aurora::pena_command(handle, aurora::TrackingPriority::kDynamic));
  }
}

bool AuroraBringup::start_tracking(std::string_view options) {
  tracking_ = true;  // also when no answer comes: it is stopped at the end
  const Answer answer = talk_.ask(aurora::with_crc("TSTART", options));
  tracking_ = answer.okay() || !answer.came;
  return answer.okay();
}

void AuroraBringup::stop_tracking() {
  if (tracking_) {
    tracking_ = !talk_.ask(aurora::tstop_command()).came;
  }
}

void AuroraBringup::poll(const aurora::CommandLine& command, nanoseconds duration) {
  const MonotonicTime until = talk_.now() + duration;
  while (talk_.now() < until) {
    if (!talk_.ask(command, seconds(1)).came) {
      talk_.rest(milliseconds(50));
    }
  }
}

void AuroraBringup::measure_with_a_handle_disabled() {
  step("tracking while one handle is not enabled");
  if (!handles_.empty()) {
    enable({handles_.begin(), handles_.end() - 1});
  }
  list(HandleQuery::kAll);
  list(HandleQuery::kEnabled);
  if (start_tracking()) {
    talk_.ask(aurora::bx_command(aurora::kTransforms));
    talk_.ask(aurora::tx_command(aurora::kTransforms));
    poll(aurora::bx_command(kAlsoOutside), milliseconds(500));
    poll(aurora::tx_command(kAlsoOutside), milliseconds(500));
  }
  stop_tracking();
}

void AuroraBringup::measure() {
  step("measuring for " + seconds_text(settings_.measuring) + ": move the tools, also out of the volume");
  enable(list(HandleQuery::kToBeEnabled));
  list(HandleQuery::kAll);
  if (!start_tracking()) {
    hooks_.progress("TSTART failed: the measuring steps are left out");
    return;
  }
  poll(aurora::bx_command(aurora::kTransforms), settings_.measuring * 40 / 100);
  poll(aurora::bx_command(kAlsoOutside), settings_.measuring * 30 / 100);
  poll(aurora::tx_command(aurora::kTransforms), settings_.measuring * 15 / 100);
  poll(aurora::tx_command(kAlsoOutside), settings_.measuring * 15 / 100);
}

void AuroraBringup::commands_while_tracking() {
  if (!tracking_) {
    return;
  }
  step("commands while tracking: PHINF, VER, APIREV, PHSR, COMM, PINIT, PDIS");
  const aurora::CommandLine bx = aurora::bx_command(kAlsoOutside);
  for (const std::uint8_t handle : handles_) {
    talk_.ask(aurora::phinf_command(handle, aurora::kToolField | aurora::kLocationField));
  }
  talk_.ask(bx);
  talk_.ask(aurora::ver_command(4));
  talk_.ask(aurora::apirev_command());
  talk_.ask(aurora::phsr_command(HandleQuery::kAll));
  aurora::LinkParameters link;
  link.rate = aurora::baud_rate(talk_.baud()).value_or(aurora::BaudRate::k9600);
  talk_.ask(aurora::comm_command(link));
  talk_.rest(milliseconds(100));
  talk_.ask(bx);
  if (!handles_.empty()) {
    talk_.ask(aurora::pinit_command(handles_.front()));
    talk_.ask(bx);
    talk_.ask(aurora::pdis_command(handles_.back()));
    talk_.ask(bx);
  }
  poll(bx, milliseconds(200));
}

void AuroraBringup::commands_during_replies() {
  if (!tracking_) {
    return;
  }
  step("the next command while a reply is leaving");
  const aurora::CommandLine bx = aurora::bx_command(kAlsoOutside);
  constexpr int kAttempts = 3;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    talk_.ask_during_reply(bx, bx);
  }
  poll(bx, milliseconds(200));
}

void AuroraBringup::pause_tracking() {
  step("counter over TSTOP and TSTART");
  const aurora::CommandLine bx = aurora::bx_command(aurora::kTransforms);
  stop_tracking();
  talk_.rest(seconds(1));
  enable(list(HandleQuery::kToBeEnabled));
  if (start_tracking()) {
    poll(bx, milliseconds(500));
  }
  stop_tracking();
}

void AuroraBringup::count_anew() {
  step("PDIS after TSTOP, then TSTART:80");
  if (!handles_.empty()) {
    talk_.ask(aurora::pdis_command(handles_.back()));
  }
  if (start_tracking("80")) {
    poll(aurora::bx_command(aurora::kTransforms), milliseconds(500));
  }
}

void AuroraBringup::init_while_tracking() {
  step("INIT while tracking");
  if (!tracking_ && !start_tracking()) {
    return;
  }
  talk_.ask(aurora::bx_command(aurora::kTransforms));
  if (talk_.ask(aurora::init_command()).okay()) {
    talk_.ask(aurora::bx_command(aurora::kTransforms));
  }
}

void AuroraBringup::ask_person() {
  start_again_after_plugging();
  if (wait_for_plug("unplug the tool at port 1 now", &aurora::SystemStatus::port_became_unoccupied)) {
    for (const std::uint8_t handle : handles_) {
      talk_.ask(aurora::phinf_command(handle, aurora::kLocationField));
    }
    wait_for_plug("plug it in again", &aurora::SystemStatus::port_became_occupied);
    start_again_after_plugging();
  }
  if (wait_for_plug("plug in another tool now", &aurora::SystemStatus::port_became_occupied)) {
    start_again_after_plugging();
  }
}

void AuroraBringup::start_again_after_plugging() {
  step("setting up the ports again");
  stop_tracking();
  free_stale_handles();
  initialise_ports();
  enable(list(HandleQuery::kToBeEnabled));
  handles_ = list(HandleQuery::kAll);
  describe_handles(handles_);
  if (start_tracking()) {
    poll(aurora::bx_command(kAlsoOutside), seconds(1));
  }
}

bool AuroraBringup::wait_for_plug(std::string_view request,
                                  bool (aurora::SystemStatus::*happened)() const noexcept) {
  constexpr seconds kReminder{10};
  const MonotonicTime until = talk_.now() + settings_.timeout_of_person;
  MonotonicTime remind = talk_.now() + kReminder;
  step(">>> " + std::string(request) + " (Enter skips, " + seconds_text(settings_.timeout_of_person) + ")");
  while (talk_.now() < until && !hooks_.skipped()) {
    aurora::TrackingReply measurement;
    const Answer answer = talk_.ask(aurora::bx_command(kAlsoOutside), seconds(1));
    if (AuroraTalk::read_measurement(answer, measurement) && (measurement.system_status.*happened)()) {
      hooks_.progress("seen");
      poll(aurora::bx_command(kAlsoOutside), seconds(1));
      return true;
    }
    if (talk_.now() >= remind) {
      hooks_.progress("still waiting, " + seconds_text(until - talk_.now()) + " left");
      remind = talk_.now() + kReminder;
    }
    talk_.rest(milliseconds(25));
  }
  talk_.note("not done: " + std::string(request));
  hooks_.progress("left out");
  return false;
}

void AuroraBringup::put_back() {
  talk_.ignore_interruption();
  if (!found_) {
    talk_.set_baud(aurora::bits_per_second(aurora::BaudRate::k9600));
    return;
  }
  step("end: TSTOP, back to 9600 baud");
  stop_tracking();
  if (!talk_.change_rate(aurora::BaudRate::k9600)) {
    talk_.send_break();
  }
}

}  // namespace tubed
