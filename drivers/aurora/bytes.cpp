#include "drivers/aurora/bytes.hpp"

namespace tubed::aurora {

namespace {

int hex_digit(char c) noexcept {
  if (c >= '0' && c <= '9') {
    return c - '0';
  }
  if (c >= 'A' && c <= 'F') {
    return c - 'A' + 10;
  }
  return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

}  // namespace

void ByteWriter::decimal(std::int64_t value, int digits) noexcept {
  u8(value < 0 ? '-' : '+');
  std::int64_t magnitude = value < 0 ? -value : value;
  std::int64_t unit = 1;
  for (int i = 1; i < digits; ++i) {
    unit *= 10;
  }
  for (; unit > 0; unit /= 10) {
    u8(static_cast<std::uint8_t>('0' + magnitude / unit % 10));
  }
}

std::optional<std::uint32_t> parse_hex(std::string_view text) noexcept {
  if (text.empty() || text.size() > 8) {
    return std::nullopt;
  }
  std::uint32_t value = 0;
  for (const char c : text) {
    const int digit = hex_digit(c);
    if (digit < 0) {
      return std::nullopt;
    }
    value = value << 4 | static_cast<std::uint32_t>(digit);
  }
  return value;
}

std::string_view TextReader::take(std::size_t size) noexcept {
  if (text_.size() < size) {
    broken_ = true;
    text_ = {};
    return {};
  }
  const std::string_view taken = text_.substr(0, size);
  text_.remove_prefix(size);
  return taken;
}

std::uint32_t TextReader::hex(std::size_t digits) noexcept {
  const auto value = parse_hex(take(digits));
  broken_ |= !value.has_value();
  return value.value_or(0);
}

std::int32_t TextReader::decimal(std::size_t digits) noexcept {
  const std::string_view field = take(1 + digits);
  if (field.empty() || (field[0] != '+' && field[0] != '-')) {
    broken_ = true;
    return 0;
  }
  std::int32_t magnitude = 0;
  for (const char c : field.substr(1)) {
    if (c < '0' || c > '9') {
      broken_ = true;
      return 0;
    }
    magnitude = magnitude * 10 + (c - '0');
  }
  return field[0] == '-' ? -magnitude : magnitude;
}

bool TextReader::skip(std::string_view word) noexcept {
  if (text_.substr(0, word.size()) != word) {
    return false;
  }
  text_.remove_prefix(word.size());
  return true;
}

}  // namespace tubed::aurora
