#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/aurora/session.hpp"
#include "drivers/aurora_serial/serial_port.hpp"
#include "drivers/aurora_serial/tool_folder.hpp"
#include "drivers/aurora_serial/trace_file.hpp"
#include "drivers/interface/condition.hpp"
#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/room.hpp"

namespace tubed {

/// An NDI Aurora at a serial port. Called by the EM acquisition thread.
///
/// The device is looked for in slices, ten times a second, by read() itself, so that a tracker that comes
/// back is found at once: open() always succeeds, and what is wrong meanwhile stands in condition(). The
/// session ends with close() and with the object.
///
/// read() says and does all that the session has to: it asks, takes what has come, opens the port, sets the
/// ports of the tracker up, and waits for none of it: pauses, replies and the next question's time are
/// wait()'s. Two things block inside read(), both only while the tracker is looked for or does not answer: a
/// serial break (0.28 s, and 0.1 s before it for a line that still has bytes) and a line that takes no bytes
/// (0.2 s a command). read() gives kNothing then, so that no time of a stage's work contains them.
class AuroraSerialSource final : public EmSource, public HasCondition, public HasIdentity {
 public:
  /// `device`: the port. Throws std::runtime_error when a tool definition file cannot be read.
  AuroraSerialSource(const RoomDescription& room, const DriverSettings& settings, const std::string& device,
                     SystemPlaces places = {});
  ~AuroraSerialSource() override { AuroraSerialSource::close(); }

  OpenResult open() override;
  void wait(MonotonicTime deadline) noexcept override;
  ReadOutcome read(EmFrame& frame) noexcept override;
  void close() noexcept override;
  [[nodiscard]] SourceCondition condition() noexcept override;
  [[nodiscard]] const TrackerIdentity& identity() noexcept override { return session_->identity(); }

  [[nodiscard]] const aurora::Session& session() const noexcept { return *session_; }

 private:
  bool open_port(MonotonicTime now) noexcept;
  ReadOutcome run_session(EmFrame& frame) noexcept;
  void write_trace(const aurora::Problem& why) noexcept;
  void answer_request(MonotonicTime now) noexcept;

  SerialPort port_;
  ToolFolder tools_;
  std::unique_ptr<aurora::Session> session_;
  TraceFolder traces_;
  std::string about_;
  aurora::Problem port_trouble_;  ///< while the port is not open
  aurora::Problem traced_;        ///< what the last trace was written for
  bool has_measured_ = false;
  bool measures_ = false;  ///< since the session was last without the tracker
  MonotonicTime next_try_{};
  MonotonicTime next_look_{};
};

}  // namespace tubed
