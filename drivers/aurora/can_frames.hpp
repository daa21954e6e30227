// Tracking data on a CAN bus: frames of our own, of fixed-point numbers. A SYNC opens each measurement; then
// comes each coil, either as one CAN FD frame of 48 bytes or as three classic frames of 8. Any thread; no
// state, no allocation. The byte tables stand in README.md.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/aurora/bytes.hpp"
#include "drivers/aurora/tracking_reply.hpp"
#include "drivers/interface/em_source.hpp"

namespace tubed::aurora {

inline constexpr std::uint32_t kCanSyncId = 0x300;
inline constexpr std::uint32_t kCanStatusId = 0x301;
inline constexpr std::uint32_t kCanFollowUpId = 0x302;
inline constexpr std::uint32_t kCanFdCoilId = 0x320;       ///< + coil
inline constexpr std::uint32_t kCanClassicCoilId = 0x340;  ///< + 4 coil + part
inline constexpr std::uint8_t kCanProtocol = 0x10;
inline constexpr int kMaxCanCoils = kMaxTrackerCoils;
inline constexpr int kClassicParts = 3;

/// What is on the bus: an 11-bit identifier and up to 64 bytes.
struct CanFrame {
  std::uint32_t id = 0;
  std::uint8_t size = 0;
  std::array<std::uint8_t, 64> bytes{};

  /// The bytes it has; never more than there can be, whatever `size` says.
  [[nodiscard]] Bytes payload() const noexcept;
};

/// Opens a measurement.
struct CanSync {
  std::uint32_t frame = 0;    ///< the tracker's counter
  std::uint32_t time_us = 0;  ///< the gateway's clock at the measurement; wraps after 71.6 min
};

/// When the SYNC was handed to the bus: the receiver learns from it how the gateway's clock lies to its own,
/// without what polling and the serial line took. Behind the SYNC; gateways may leave it out.
struct CanFollowUp {
  std::uint8_t sequence = 0;  ///< of the SYNC
  std::uint32_t sent_us = 0;  ///< the gateway's clock, as CanSync::time_us
};

/// Bit of CanStatus::gateway_error: the tracker is an emulated one.
inline constexpr std::uint8_t kCanSimulated = 0x80;

/// State of tracker and gateway, at least once a second and when it changes.
struct CanStatus {
  std::uint8_t protocol = kCanProtocol;
  int coil_count = 0;
  SystemStatus system_status;
  std::uint16_t ports_present = 0;  ///< bit p - 1: something is plugged in at port p
  std::uint8_t gateway_error = 0;
};

enum class CanCoilState : std::uint8_t { kDisabled = 0, kValid = 1, kMissing = 2 };

/// One coil as it came over the bus. Pose is NaN unless `state` is kValid.
struct CanCoil {
  static constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  int coil = 0;  ///< counts from 0 in the order of the gateway's configuration
  CanCoilState state = CanCoilState::kMissing;
  Eigen::Vector3d p_em_mm{kNaN, kNaN, kNaN};
  Eigen::Vector3d axis_em{kNaN, kNaN, kNaN};  ///< unit vector, as measured
  double indicator = kNaN;
  PortStatus port_status;  ///< classic frames carry the seven bits with a name only
};

/// A coil's FD frame also says which measurement it is of.
struct CanFdCoil {
  CanCoil coil;
  std::uint8_t sequence = 0;
  CanSync measurement;
  SystemStatus system_status;
  std::uint32_t tool_serial_number = 0;
};

/// One of a coil's three classic frames, its check sum right.
struct CanClassicPart {
  int coil = 0;
  int part = 0;               ///< 0 to 2
  std::uint8_t sequence = 0;  ///< lower 4 bits
  CanCoilState state = CanCoilState::kMissing;
  std::array<std::uint8_t, 6> bytes{};
};

/// Number that binds a coil's frames to their SYNC: the measurement's, counted in steps of the frame number.
/// Classic frames have its lower 4 bits.
[[nodiscard]] std::uint8_t can_sequence(std::uint32_t frame) noexcept;

[[nodiscard]] CanFrame pack_sync(const CanSync& sync) noexcept;
[[nodiscard]] CanFrame pack_follow_up(const CanFollowUp& follow_up) noexcept;
[[nodiscard]] CanFrame pack_status(const CanStatus& status) noexcept;
/// `coil` in 0 .. kMaxCanCoils - 1. A pose that the fixed point cannot hold (over 2147 m, for classic
/// over 8.388 m) is sent as missing.
[[nodiscard]] CanFrame pack_fd_coil(int coil, const HandleReading& reading, const CanSync& measurement,
                                    SystemStatus system_status, std::uint32_t tool_serial_number) noexcept;
[[nodiscard]] std::array<CanFrame, kClassicParts> pack_classic_coil(int coil, const HandleReading& reading,
                                                                    const CanSync& measurement) noexcept;

/// Each gives nothing when identifier, size, check sum, protocol or state is not what such a frame has, or
/// an axis is not of unit length (within 0.2 %). SYNC has no check sum but the bus's own.
[[nodiscard]] std::optional<CanSync> unpack_sync(const CanFrame& frame) noexcept;
[[nodiscard]] std::optional<CanFollowUp> unpack_follow_up(const CanFrame& frame) noexcept;
[[nodiscard]] std::optional<CanStatus> unpack_status(const CanFrame& frame) noexcept;
[[nodiscard]] std::optional<CanFdCoil> unpack_fd_coil(const CanFrame& frame) noexcept;
[[nodiscard]] std::optional<CanClassicPart> unpack_classic_part(const CanFrame& frame) noexcept;
/// Parts 0, 1, 2 of one coil; nothing when they are not, or differ in sequence or state.
[[nodiscard]] std::optional<CanCoil> join_classic_parts(
    const std::array<CanClassicPart, kClassicParts>& parts) noexcept;

/// The coil as the daemon takes it, by the rules of coil_status() and coil_sample() for serial replies.
[[nodiscard]] CoilSample coil_sample(const CanCoil& coil) noexcept;

}  // namespace tubed::aurora
