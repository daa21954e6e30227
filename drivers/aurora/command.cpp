#include "drivers/aurora/command.hpp"

#include <algorithm>
#include <utility>

#include "drivers/aurora/checksums.hpp"

namespace tubed::aurora {

namespace {

constexpr std::pair<BaudRate, int> kRateCodes[] = {
    {BaudRate::k9600, 9600},     {BaudRate::k14400, 14400},     {BaudRate::k19200, 19200},
    {BaudRate::k38400, 38400},   {BaudRate::k57600, 57600},     {BaudRate::k115200, 115200},
    {BaudRate::k921600, 921600}, {BaudRate::k1228739, 1228739}, {BaudRate::k230400, 230400},
};

/// Parameters of a command, built up in place.
class Parameters {
 public:
  Parameters& hex(std::uint32_t value, int digits) noexcept {
    writer_.hex(value, digits);
    return *this;
  }
  Parameters& letter(char c) noexcept {
    writer_.u8(static_cast<std::uint8_t>(c));
    return *this;
  }
  [[nodiscard]] std::string_view text() const noexcept { return as_text(writer_.written()); }

  Parameters() = default;
  Parameters(const Parameters&) = delete;  // the writer points into this object
  Parameters& operator=(const Parameters&) = delete;
  ~Parameters() = default;

 private:
  std::array<std::uint8_t, CommandLine::kCapacity> room_{};
  ByteWriter writer_{room_};
};

std::span<std::uint8_t> writable(std::array<char, CommandLine::kCapacity>& characters) noexcept {
  return {reinterpret_cast<std::uint8_t*>(characters.data()), characters.size()};
}

CommandLine handle_command(std::string_view name, std::uint8_t handle) noexcept {
  return with_crc(name, Parameters{}.hex(handle, 2).text());
}

template <typename Setting>
bool take(std::optional<Setting>& setting, char c, std::initializer_list<Setting> allowed) noexcept {
  const auto* const found = std::find(allowed.begin(), allowed.end(), static_cast<Setting>(c));
  if (found != allowed.end()) {
    setting = *found;
  }
  return found != allowed.end();
}

}  // namespace

CommandLine with_crc(std::string_view name, std::string_view parameters) noexcept {
  CommandLine line;
  ByteWriter writer(writable(line.characters_));
  writer.text(name);
  writer.text(":");
  writer.text(parameters);
  writer.hex(crc16(writer.written()), 4);
  writer.text("\r");
  line.size_ = writer.overrun() ? 0 : writer.size();
  return line;
}

CommandLine without_crc(std::string_view name, std::string_view parameters) noexcept {
  CommandLine line;
  ByteWriter writer(writable(line.characters_));
  writer.text(name);
  writer.text(" ");
  writer.text(parameters);
  writer.text("\r");
  line.size_ = writer.overrun() ? 0 : writer.size();
  return line;
}

int bits_per_second(BaudRate rate) noexcept {
  for (const auto& [known, bits] : kRateCodes) {
    if (known == rate) {
      return bits;
    }
  }
  return 0;
}

std::optional<BaudRate> baud_rate(int bits_per_second) noexcept {
  for (const auto& [rate, bits] : kRateCodes) {
    if (bits == bits_per_second) {
      return rate;
    }
  }
  return std::nullopt;
}

std::optional<LinkParameters> parse_link_parameters(std::string_view parameters) noexcept {
  if (parameters.size() != 5 || bits_per_second(static_cast<BaudRate>(parameters[0])) == 0) {
    return std::nullopt;
  }
  std::optional<DataBits> data_bits;
  std::optional<Parity> parity;
  std::optional<StopBits> stop_bits;
  std::optional<Handshake> handshake;
  const bool known = take(data_bits, parameters[1], {DataBits::k8, DataBits::k7}) &&
                     take(parity, parameters[2], {Parity::kNone, Parity::kOdd, Parity::kEven}) &&
                     take(stop_bits, parameters[3], {StopBits::k1, StopBits::k2}) &&
                     take(handshake, parameters[4], {Handshake::kNone, Handshake::kRtsCts});
  if (!known) {
    return std::nullopt;
  }
  return LinkParameters{static_cast<BaudRate>(parameters[0]), *data_bits, *parity, *stop_bits, *handshake};
}

CommandLine init_command() noexcept { return with_crc("INIT", ""); }

CommandLine comm_command(const LinkParameters& link) noexcept {
  const std::array<char, 5> letters = {static_cast<char>(link.rate), static_cast<char>(link.data_bits),
                                       static_cast<char>(link.parity), static_cast<char>(link.stop_bits),
                                       static_cast<char>(link.handshake)};
  return with_crc("COMM", {letters.data(), letters.size()});
}

CommandLine ver_command(int item) noexcept {
  return with_crc("VER", Parameters{}.hex(static_cast<std::uint32_t>(item), 1).text());
}

CommandLine apirev_command() noexcept { return with_crc("APIREV", ""); }

CommandLine phsr_command(HandleQuery query) noexcept {
  return with_crc("PHSR", Parameters{}.hex(static_cast<std::uint8_t>(query), 2).text());
}

CommandLine phinf_command(std::uint8_t handle, std::uint16_t fields) noexcept {
  return with_crc("PHINF", Parameters{}.hex(handle, 2).hex(fields, 4).text());
}

CommandLine pinit_command(std::uint8_t handle) noexcept { return handle_command("PINIT", handle); }

CommandLine pena_command(std::uint8_t handle, TrackingPriority priority) noexcept {
  return with_crc("PENA", Parameters{}.hex(handle, 2).letter(static_cast<char>(priority)).text());
}

CommandLine pdis_command(std::uint8_t handle) noexcept { return handle_command("PDIS", handle); }
CommandLine phf_command(std::uint8_t handle) noexcept { return handle_command("PHF", handle); }

CommandLine pvwr_command(std::uint8_t handle, std::uint16_t address, Bytes block) noexcept {
  Parameters parameters;
  parameters.hex(handle, 2).hex(address, 4);
  for (std::size_t i = 0; i < kToolMemoryBlock; ++i) {
    parameters.hex(i < block.size() ? block[i] : 0U, 2);
  }
  return with_crc("PVWR", parameters.text());
}

CommandLine tstart_command() noexcept { return with_crc("TSTART", ""); }
CommandLine tstop_command() noexcept { return with_crc("TSTOP", ""); }
CommandLine tx_command(std::uint16_t options) noexcept {
  return with_crc("TX", Parameters{}.hex(options, 4).text());
}
CommandLine bx_command(std::uint16_t options) noexcept {
  return with_crc("BX", Parameters{}.hex(options, 4).text());
}
CommandLine get_command(std::string_view user_parameter) noexcept { return with_crc("GET", user_parameter); }

std::optional<ReceivedCommand> parse_command(std::string_view line) noexcept {
  const std::size_t end_of_name = line.find_first_of(": ");
  if (end_of_name == 0 || end_of_name == std::string_view::npos) {
    return std::nullopt;
  }
  ReceivedCommand command{line.substr(0, end_of_name), line.substr(end_of_name + 1)};
  if (line[end_of_name] == ' ') {
    return command;
  }
  constexpr std::size_t kCrcDigits = 4;
  if (command.parameters.size() < kCrcDigits) {
    command.crc_matches = false;
    return command;
  }
  const auto sent = parse_hex(line.substr(line.size() - kCrcDigits));
  command.crc_matches = sent == crc16(line.substr(0, line.size() - kCrcDigits));
  command.parameters.remove_suffix(kCrcDigits);
  return command;
}

}  // namespace tubed::aurora
