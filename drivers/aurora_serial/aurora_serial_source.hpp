#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/aurora/session.hpp"
#include "drivers/aurora_serial/serial_port.hpp"
#include "drivers/aurora_serial/trace_file.hpp"
#include "drivers/interface/driver_settings.hpp"
#include "drivers/interface/em_source.hpp"
#include "drivers/interface/remark.hpp"
#include "drivers/interface/room.hpp"

namespace tubed {

/// An NDI Aurora at a serial port. Called by the EM acquisition thread.
///
/// Whatever goes wrong is told once: read() says kLost, the next open() says why, and from then on read()
/// goes on trying in slices, ten times a second, so that a tracker that comes back is found at once. The
/// session is kept meanwhile. It ends with close() in any other state, and with the object.
class AuroraSerialSource final : public EmSource, public HasRemark {
 public:
  /// `device`: the port. Throws std::runtime_error when a tool definition file cannot be read.
  AuroraSerialSource(const RoomDescription& room, const DriverSettings& settings, const std::string& device);
  ~AuroraSerialSource() override { shut_down(); }

  OpenResult open() override;
  ReadOutcome read(EmFrame& frame, MonotonicTime deadline) noexcept override;
  void close() noexcept override;
  /// Which coils are not plugged in.
  [[nodiscard]] std::string_view remark() noexcept override;

  [[nodiscard]] const aurora::Session& session() const noexcept { return *session_; }

 private:
  ReadOutcome tell(const aurora::Problem& problem) noexcept;
  bool open_port(MonotonicTime now) noexcept;
  void shut_down() noexcept;
  void answer_request(MonotonicTime now) noexcept;

  SerialPort port_;
  std::vector<std::vector<std::uint8_t>> tool_bytes_;
  std::vector<aurora::ToolDefinition> tools_;
  std::unique_ptr<aurora::Session> session_;
  TraceFolder traces_;
  std::string about_;
  aurora::Problem problem_;  ///< to be told by the next open()
  aurora::Problem told_;     ///< the last one that was told, until there is a measurement
  aurora::Problem remark_;
  bool keep_ = false;  ///< close() only pauses
  MonotonicTime next_try_{};
  MonotonicTime next_look_{};
};

}  // namespace tubed
