// One end of a CAN bus: frames in and out, and what the controller says is wrong.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/aurora/can_frames.hpp"
#include "drivers/aurora_can/error_frame.hpp"
#include "drivers/interface/timestamps.hpp"

namespace tubed {

/// What one look at the bus gave.
struct CanArrival {
  enum class Kind {
    kNothing,     ///< the deadline has come
    kFrame,       ///< see `frame`
    kErrorFrame,  ///< see `trouble`
    kUnreadable,  ///< something that is no frame of ours: of another size, or remote
    kGone         ///< the interface is down or away, see `error`; close the port
  };
  Kind kind = Kind::kNothing;
  aurora::CanFrame frame;
  CanTrouble trouble;
  MonotonicTime received{};  ///< when the kernel had it, or now where it does not say
  int error = 0;             ///< errno of kGone
};

/// Reads and writes `can_frame` and `canfd_frame` at a descriptor that connect() makes: of an interface
/// (CanInterface), or of a socket pair where there is no CAN. One thread. Only open() may allocate.
class CanPort {
 public:
  virtual ~CanPort() { close(); }
  CanPort() = default;
  CanPort(const CanPort&) = delete;
  CanPort& operator=(const CanPort&) = delete;

  /// What stands in front of every complaint: "can0".
  [[nodiscard]] virtual std::string_view name() const noexcept = 0;
  /// What is wrong and what to do when open(), read() or write() gave `error`, to stand behind the name. The
  /// text is constant.
  [[nodiscard]] virtual std::string_view describe(int error) const noexcept;

  /// 0, or errno. Harmless when open.
  int open() noexcept;
  void close() noexcept;
  [[nodiscard]] bool is_open() const noexcept { return descriptor_ >= 0; }

  /// Sleeps until read() has something, until `deadline` at most. Precondition: is_open().
  void wait(MonotonicTime deadline) noexcept;
  /// Waits for the next frame until `deadline`; one in the past only looks.
  [[nodiscard]] CanArrival read(MonotonicTime deadline) noexcept;

  /// 0 or errno. Waits until `deadline` for room in the queue of the interface, which is short: ENOBUFS when
  /// there was none. Frames of more than 8 bytes go out as CAN FD with the fast data rate.
  [[nodiscard]] int write(const aurora::CanFrame& frame, MonotonicTime deadline) noexcept;

  /// Frames that the kernel has thrown away because nobody read them, since the beginning.
  [[nodiscard]] std::uint64_t overflowed() const noexcept { return overflowed_; }

 protected:
  /// Gives a descriptor, or -errno.
  virtual int connect() noexcept = 0;

 private:
  int descriptor_ = -1;
  std::uint32_t overflow_seen_ = 0;  ///< the kernel's count for this descriptor
  std::uint64_t overflowed_ = 0;
};

/// What a receiver needs of the bus, or a gateway.
enum class CanUse {
  kReceive,      ///< frames of a gateway, and error frames
  kListen,       ///< frames of everybody, and error frames
  kSendClassic,  ///< nothing is received
  kSendFd
};

/// An interface of Linux, as can0 or vcan0.
class CanInterface final : public CanPort {
 public:
  /// `receive_buffer`: bytes that the kernel keeps for us; 0 = its default.
  /// `base`: of the gateway whose frames kReceive lets through.
  CanInterface(std::string name, CanUse use, int receive_buffer = 0, aurora::CanBase base = {})
      : name_(std::move(name)), use_(use), receive_buffer_(receive_buffer), base_(base) {}

  [[nodiscard]] std::string_view name() const noexcept override { return name_; }

 protected:
  int connect() noexcept override;

 private:
  int configure(int descriptor) const noexcept;

  std::string name_;
  CanUse use_;
  int receive_buffer_;
  aurora::CanBase base_;
};

/// The same for interfaces: "is down: ...".
[[nodiscard]] std::string_view describe_can_error(int error) noexcept;

}  // namespace tubed
