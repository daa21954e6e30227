#include "drivers/aurora_serial/aurora_serial_source.hpp"

#include <algorithm>

#include "drivers/interface/monotonic_clock.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kBetweenTries{100};
constexpr seconds kBetweenLooks{1};
constexpr std::chrono::microseconds kMaxLook{500};  // between two measurements, which are 25 ms apart

std::chrono::nanoseconds from_ms(double ms) {
  return std::chrono::nanoseconds(static_cast<std::int64_t>(ms * 1e6));
}

aurora::SessionSettings session_settings(const DriverSettings& settings) {
  aurora::SessionSettings session;
  session.baud = aurora::baud_rate(std::stoi(settings.get<std::string>("baud"))).value();
  session.poller.reply_margin = from_ms(settings.get<double>("reply_margin_ms"));
  session.poller.latency = from_ms(settings.get<double>("latency_ms"));
  session.trace_capacity = static_cast<std::size_t>(settings.get<std::int64_t>("trace_kb")) << 10U;
  return session;
}

}  // namespace

AuroraSerialSource::AuroraSerialSource(const RoomDescription& room, const DriverSettings& settings,
                                       const std::string& device, SystemPlaces places)
    : port_(device, std::move(places)),
      tools_(settings.get<std::string>("tool_folder"), "aurora-serial.tool_folder"),
      session_(std::make_unique<aurora::Session>(session_settings(settings), aurora::CoilMap(room),
                                                 tools_.tools())),
      traces_(settings.get<std::string>("trace_folder"), "aurora-serial"),
      about_("aurora-serial, " + device + ", tubed " TUBED_VERSION) {}

OpenResult AuroraSerialSource::open() {
  next_try_ = {};
  return {true, {}};
}

bool AuroraSerialSource::open_port(MonotonicTime now) noexcept {
  if (now < next_try_) {
    return false;
  }
  next_try_ = now + kBetweenTries;
  const int error = port_.open();
  if (error == 0) {
    session_->attach(port_);
    port_trouble_.clear();
    return true;
  }
  port_trouble_ = port_.explain(error);
  return false;
}

void AuroraSerialSource::wait(MonotonicTime deadline) noexcept {
  if (port_.is_open()) {
    port_.wait(std::min(deadline, session_->due()));
  } else {
    sleep_until(next_try_, deadline);
  }
}

ReadOutcome AuroraSerialSource::read(EmFrame& frame) noexcept {
  const ReadOutcome outcome =
      port_.is_open() || open_port(monotonic_now()) ? run_session(frame) : ReadOutcome::kNothing;
  if (outcome == ReadOutcome::kNothing) {
    answer_request(monotonic_now());  // not while a measurement waits to be handed on
  }
  return outcome;
}

ReadOutcome AuroraSerialSource::run_session(EmFrame& frame) noexcept {
  switch (session_->run(monotonic_now(), frame)) {
    case aurora::Session::Event::kMeasurement:
      has_measured_ = measures_ = true;
      traced_.clear();
      return ReadOutcome::kFrame;
    case aurora::Session::Event::kRefused:
      return ReadOutcome::kRefused;
    case aurora::Session::Event::kProblem:
      write_trace(session_->problem());
      break;
    case aurora::Session::Event::kGone:
      port_.close();
      next_try_ = monotonic_now() + kBetweenTries;  // the words below are said until then
      port_trouble_ = aurora::Problem(port_.path());
      port_trouble_ << " has gone: its cable was pulled or its driver has failed";
      write_trace(port_trouble_);
      break;
    case aurora::Session::Event::kQuiet:
      break;
  }
  measures_ = measures_ && session_->phase() == aurora::Session::Phase::kTrack && port_.is_open();
  return ReadOutcome::kNothing;
}

SourceCondition AuroraSerialSource::condition() noexcept {
  SourceCondition condition;
  condition.state = measures_       ? DeviceState::kRunning
                    : has_measured_ ? DeviceState::kReconnecting
                                    : DeviceState::kStarting;
  condition.words = port_.is_open() ? session_->describe() : port_trouble_;
  if (port_.is_open() && !port_.note().empty()) {
    condition.words << (condition.words.empty() ? "" : "; ") << port_.note().text();
  }
  return condition;
}

// The last minutes of the line, once for each kind of failure until there is a measurement.
void AuroraSerialSource::write_trace(const aurora::Problem& why) noexcept {
  if (!(why == traced_)) {
    traced_ = why;
    traces_.write(session_->exchange().trace(), about_);
  }
}

void AuroraSerialSource::close() noexcept {
  if (port_.is_open()) {
    session_->close();
    port_.close();
  }
  measures_ = false;
}

void AuroraSerialSource::answer_request(MonotonicTime now) noexcept {
  if (now < next_look_) {
    return;
  }
  next_look_ = now + kBetweenLooks;
  port_.look_around(kMaxLook);  // a program that opens the port later is told, too
  if (traces_.asked_for()) {
    traces_.write_on_request(session_->exchange().trace(), about_);
  }
}

}  // namespace tubed
