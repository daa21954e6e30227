#include "drivers/aurora_serial/usb_adapter.hpp"

#include <fcntl.h>
#include <sys/sysmacros.h>

#include <charconv>
#include <string>

namespace tubed {

namespace {

constexpr int kHexadecimal = 16;
constexpr int kDecimal = 10;

std::optional<unsigned> read_number(const PathText& path, int base) noexcept {
  std::array<char, 32> room{};
  const std::string_view text = read_line(path, room);
  unsigned number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

PathText folder_of(const SystemPlaces& places, dev_t device) noexcept {
  return PathText("%s/dev/char/%u:%u", places.sys.c_str(), ::major(device), ::minor(device));
}

/// `terminal`: folder of the tty. Its device is a port of the interface (ttyUSB) or the interface itself
/// (ttyACM), and that belongs to the USB device.
std::optional<UsbIdentity> identity_at(const PathText& terminal) noexcept {
  for (const char* const interface : {"device/..", "device"}) {
    const auto number =
        read_number(PathText("%s/%s/bInterfaceNumber", terminal.c_str(), interface), kHexadecimal);
    const auto vendor = read_number(PathText("%s/%s/../idVendor", terminal.c_str(), interface), kHexadecimal);
    const auto product =
        read_number(PathText("%s/%s/../idProduct", terminal.c_str(), interface), kHexadecimal);
    if (number && vendor && product) {
      std::array<char, 128> room{};
      const PathText serial_number("%s/%s/../serial", terminal.c_str(), interface);
      return UsbIdentity{*vendor, *product, *number, BoundedText<64>(read_line(serial_number, room))};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<UsbIdentity> usb_identity(const SystemPlaces& places, dev_t device) noexcept {
  return identity_at(folder_of(places, device));
}

std::optional<int> latency_timer_ms(const SystemPlaces& places, dev_t device) noexcept {
  const auto read =
      read_number(PathText("%s/device/latency_timer", folder_of(places, device).c_str()), kDecimal);
  return read ? std::optional(static_cast<int>(*read)) : std::nullopt;
}

BoundedText<32> device_name(const SystemPlaces& places, dev_t device) noexcept {
  std::array<char, 512> room{};
  return BoundedText<32>(last_component(read_link(AT_FDCWD, folder_of(places, device).c_str(), room)));
}

BoundedText<32> find_adapter(const SystemPlaces& places, const UsbIdentity& identity) noexcept {
  FolderEntries terminals;
  terminals.open(PathText("%s/class/tty", places.sys.c_str()));
  BoundedText<32> found;
  while (const char* const name = terminals.next()) {
    const std::string_view text(name);
    if (!text.starts_with("ttyUSB") && !text.starts_with("ttyACM")) {
      continue;
    }
    if (identity_at(PathText("%s/class/tty/%s", places.sys.c_str(), name)) == identity) {
      if (!found.empty()) {
        return {};
      }
      found << text;
    }
  }
  return found;
}

BoundedText<160> path_by_id(const SystemPlaces& places, std::string_view name) noexcept {
  FolderEntries links;
  links.open(PathText("%s/serial/by-id", places.dev.c_str()));
  std::array<char, 512> room{};
  while (const char* const link = links.next()) {
    if (last_component(read_link(links.descriptor(), link, room)) == name) {
      return BoundedText<160>("/dev/serial/by-id/") << link;
    }
  }
  return {};
}

BoundedText<96> describe(const UsbIdentity& identity) noexcept {
  std::array<char, 24> numbers{};
  std::snprintf(numbers.data(), numbers.size(), "%04x:%04x", identity.vendor, identity.product);
  BoundedText<96> words(numbers.data());
  return identity.serial_number.empty() ? words
                                        : words << ", serial number " << identity.serial_number.text();
}

}  // namespace tubed
