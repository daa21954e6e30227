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
#include "drivers/aurora/can_identifiers.hpp"
#include "drivers/aurora/can_status.hpp"
#include "drivers/aurora/tracking_reply.hpp"
#include "drivers/interface/em_source.hpp"

namespace tubed::aurora {

inline constexpr std::uint8_t kCanProtocol = CanStatus::kProtocol;
/// Bit of CanStatus::gateway_error: the tracker is an emulated one.
inline constexpr std::uint8_t kCanSimulated = CanStatus::kSimulated;
inline constexpr int kMaxCanCoils = kMaxTrackerCoils;
inline constexpr int kClassicParts = 3;
static_assert(CanBase::kClassicCoilAt + 4 * kMaxCanCoils == CanBase::kBlock);

/// What is on the bus: an identifier, with kCanExtended when it has 29 bits, and up to 64 bytes.
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

/// Whether a frame of that identifier is one of a coil, by its place in the block.
[[nodiscard]] bool is_fd_coil(std::uint32_t id, CanBase base = {}) noexcept;
[[nodiscard]] bool is_classic_coil(std::uint32_t id, CanBase base = {}) noexcept;

/// Number that binds a coil's frames to their SYNC: the measurement's, counted in steps of the frame number.
/// Classic frames have its lower 4 bits.
[[nodiscard]] std::uint8_t can_sequence(std::uint32_t frame) noexcept;

[[nodiscard]] CanFrame pack_sync(const CanSync& sync, CanBase base = {}) noexcept;
[[nodiscard]] CanFrame pack_follow_up(const CanFollowUp& follow_up, CanBase base = {}) noexcept;
[[nodiscard]] CanFrame pack_status(const CanStatus& status, CanBase base = {}) noexcept;
/// `coil` in 0 .. kMaxCanCoils - 1. A pose that the fixed point cannot hold (over 2147 m, for classic
/// over 8.388 m) is sent as missing.
[[nodiscard]] CanFrame pack_fd_coil(int coil, const HandleReading& reading, const CanSync& measurement,
                                    SystemStatus system_status, std::uint32_t tool_serial_number,
                                    CanBase base = {}) noexcept;
[[nodiscard]] std::array<CanFrame, kClassicParts> pack_classic_coil(int coil, const HandleReading& reading,
                                                                    const CanSync& measurement,
                                                                    CanBase base = {}) noexcept;

/// Each gives nothing when identifier (another base's too), size, check sum, protocol or state is not what
/// such a frame has, or an axis is not of unit length (within 0.2 %). SYNC has no check sum but the bus's
/// own.
[[nodiscard]] std::optional<CanSync> unpack_sync(const CanFrame& frame, CanBase base = {}) noexcept;
[[nodiscard]] std::optional<CanFollowUp> unpack_follow_up(const CanFrame& frame, CanBase base = {}) noexcept;
[[nodiscard]] std::optional<CanStatus> unpack_status(const CanFrame& frame, CanBase base = {}) noexcept;
[[nodiscard]] std::optional<CanFdCoil> unpack_fd_coil(const CanFrame& frame, CanBase base = {}) noexcept;
[[nodiscard]] std::optional<CanClassicPart> unpack_classic_part(const CanFrame& frame,
                                                                CanBase base = {}) noexcept;
/// Parts 0, 1, 2 of one coil; nothing when they are not, or differ in sequence or state.
[[nodiscard]] std::optional<CanCoil> join_classic_parts(
    const std::array<CanClassicPart, kClassicParts>& parts) noexcept;

/// The coil as the daemon takes it, by the rules of coil_status() and coil_sample() for serial replies.
[[nodiscard]] CoilSample coil_sample(const CanCoil& coil) noexcept;

}  // namespace tubed::aurora
