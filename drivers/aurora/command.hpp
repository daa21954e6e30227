// Commands to an Aurora: written by the driver, read by whatever plays the tracker. Any thread; no state, no
// allocation.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/aurora/bytes.hpp"

namespace tubed::aurora {

/// One command ready to be sent, carriage return and all. The longest is PVWR with 144 bytes.
class CommandLine {
 public:
  static constexpr std::size_t kCapacity = 160;

  [[nodiscard]] std::string_view text() const noexcept { return {characters_.data(), size_}; }
  [[nodiscard]] Bytes bytes() const noexcept { return as_bytes(text()); }
  /// A command that did not fit: there is nothing to send.
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }

 private:
  friend CommandLine with_crc(std::string_view name, std::string_view parameters) noexcept;
  friend CommandLine without_crc(std::string_view name, std::string_view parameters) noexcept;
  std::array<char, kCapacity> characters_{};
  std::size_t size_ = 0;
};

/// `NAME:parameters`, its CRC-16 as four digits, carriage return. Empty when longer than a CommandLine.
[[nodiscard]] CommandLine with_crc(std::string_view name, std::string_view parameters) noexcept;
/// `NAME parameters` and carriage return: the form without check sum, whose space is always there.
[[nodiscard]] CommandLine without_crc(std::string_view name, std::string_view parameters) noexcept;

enum class BaudRate : char {
  k9600 = '0',
  k14400 = '1',
  k19200 = '2',
  k38400 = '3',
  k57600 = '4',
  k115200 = '5',
  k921600 = '6',
  k1228739 = '7',
  k230400 = 'A',
};
[[nodiscard]] int bits_per_second(BaudRate rate) noexcept;
[[nodiscard]] std::optional<BaudRate> baud_rate(int bits_per_second) noexcept;

enum class DataBits : char { k8 = '0', k7 = '1' };
enum class Parity : char { kNone = '0', kOdd = '1', kEven = '2' };
enum class StopBits : char { k1 = '0', k2 = '1' };
enum class Handshake : char { kNone = '0', kRtsCts = '1' };

/// What COMM sets. BX needs eight data bits.
struct LinkParameters {
  BaudRate rate = BaudRate::k9600;
  DataBits data_bits = DataBits::k8;
  Parity parity = Parity::kNone;
  StopBits stop_bits = StopBits::k1;
  Handshake handshake = Handshake::kNone;

  friend bool operator==(const LinkParameters&, const LinkParameters&) = default;
};
/// The five characters after COMM, or nothing when they are none.
[[nodiscard]] std::optional<LinkParameters> parse_link_parameters(std::string_view parameters) noexcept;

/// Which handles PHSR lists.
enum class HandleQuery : std::uint8_t {
  kAll = 0,
  kToBeFreed = 1,
  kToBeInitialised = 2,
  kToBeEnabled = 3,
  kEnabled = 4
};
/// How a tool is tracked: PENA's letter.
enum class TrackingPriority : char { kStatic = 'S', kDynamic = 'D', kButtonBox = 'B' };

/// Options of TX and BX: transforms, and transforms of coils outside the volume as well.
inline constexpr std::uint16_t kTransforms = 0x0001;
inline constexpr std::uint16_t kAlsoOutOfVolume = 0x0800;

/// Fields PHINF can be asked for, in the order in which the reply has them.
inline constexpr std::uint16_t kToolField = 0x0001;
inline constexpr std::uint16_t kPartNumberField = 0x0004;
inline constexpr std::uint16_t kLocationField = 0x0020;

inline constexpr std::size_t kToolMemoryBlock = 64;  ///< bytes of a tool's memory in one PVWR

[[nodiscard]] CommandLine init_command() noexcept;
[[nodiscard]] CommandLine comm_command(const LinkParameters& link) noexcept;
[[nodiscard]] CommandLine ver_command(int item) noexcept;
[[nodiscard]] CommandLine apirev_command() noexcept;
[[nodiscard]] CommandLine phsr_command(HandleQuery query) noexcept;
[[nodiscard]] CommandLine phinf_command(std::uint8_t handle, std::uint16_t fields) noexcept;
[[nodiscard]] CommandLine pinit_command(std::uint8_t handle) noexcept;
[[nodiscard]] CommandLine pena_command(std::uint8_t handle, TrackingPriority priority) noexcept;
[[nodiscard]] CommandLine pdis_command(std::uint8_t handle) noexcept;
[[nodiscard]] CommandLine phf_command(std::uint8_t handle) noexcept;
/// One block of a tool definition file. `block` has kToolMemoryBlock bytes; a shorter one is filled with
/// zeros.
[[nodiscard]] CommandLine pvwr_command(std::uint8_t handle, std::uint16_t address, Bytes block) noexcept;
[[nodiscard]] CommandLine tstart_command() noexcept;
[[nodiscard]] CommandLine tstop_command() noexcept;
[[nodiscard]] CommandLine tx_command(std::uint16_t options) noexcept;
[[nodiscard]] CommandLine bx_command(std::uint16_t options) noexcept;
[[nodiscard]] CommandLine get_command(std::string_view user_parameter) noexcept;

/// A command as the tracker reads it. The views look into the line that was given.
struct ReceivedCommand {
  std::string_view name;  ///< as sent; names are not case-sensitive
  std::string_view parameters;
  bool crc_matches = true;  ///< false: the form with a check sum, and it is wrong (ERROR04)
};

/// Takes a command apart; `line` is without its carriage return. Nothing when there is no name.
[[nodiscard]] std::optional<ReceivedCommand> parse_command(std::string_view line) noexcept;

}  // namespace tubed::aurora
