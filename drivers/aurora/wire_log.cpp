#include "drivers/aurora/wire_log.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

namespace tubed::aurora {

namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;
constexpr std::int64_t kNsPerMicrosecond = 1'000;
constexpr std::int64_t kMaxSeconds = 1'000'000'000;
constexpr int kMaxBitsPerSecond = 100'000'000;

/// Text put into a room that is long enough.
class Line {
 public:
  explicit Line(std::span<char> room) : room_(room) {}

  void put(char c) noexcept {
    if (size_ < room_.size()) {
      room_[size_++] = c;
    }
  }
  void put(std::string_view text) noexcept {
    std::for_each(text.begin(), text.end(), [this](char c) { put(c); });
  }
  void number(std::int64_t value) noexcept {
    std::array<char, 24> digits{};
    const auto end = std::to_chars(digits.begin(), digits.end(), value).ptr;
    put(std::string_view(digits.data(), static_cast<std::size_t>(end - digits.data())));
  }
  /// Seconds with six digits of the fraction.
  void seconds(std::chrono::nanoseconds time) noexcept {
    const std::int64_t us = std::max<std::int64_t>(time.count(), 0) / kNsPerMicrosecond;
    number(us / 1'000'000);
    put('.');
    for (std::int64_t digit = 100'000; digit > 0; digit /= 10) {
      put(static_cast<char>('0' + us / digit % 10));
    }
  }
  void escaped(Bytes bytes) noexcept {
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      byte(bytes[i], i + 1 == bytes.size());
    }
  }
  [[nodiscard]] std::string_view text() const noexcept { return {room_.data(), size_}; }

 private:
  // A blank at the end of a line would not survive an editor.
  void byte(std::uint8_t value, bool last) noexcept {
    constexpr std::uint8_t kFirstPrintable = 0x20;
    constexpr std::uint8_t kLastPrintable = 0x7E;
    if (value == '\r') {
      put("\\r");
    } else if (value == '\n') {
      put("\\n");
    } else if (value == '\\') {
      put("\\\\");
    } else if (value < kFirstPrintable || value > kLastPrintable || (value == ' ' && last)) {
      put("\\x");
      put("0123456789ABCDEF"[value >> 4U]);
      put("0123456789ABCDEF"[value & 0xFU]);
    } else {
      put(static_cast<char>(value));
    }
  }

  std::span<char> room_;
  std::size_t size_ = 0;
};

/// `text` with its escapes undone; nothing when there is a faulty one.
std::optional<std::vector<std::uint8_t>> unescaped(std::string_view text) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\') {
      bytes.push_back(static_cast<std::uint8_t>(text[i]));
      continue;
    }
    const char kind = ++i < text.size() ? text[i] : '\0';
    if (kind == 'r' || kind == 'n' || kind == '\\') {
      bytes.push_back(static_cast<std::uint8_t>(kind == 'r' ? '\r' : kind == 'n' ? '\n' : '\\'));
    } else if (kind == 'x') {
      const std::string_view digits = text.substr(i + 1, 2);
      const auto value = parse_hex(digits);
      if (digits.size() != 2 || !value) {
        return std::nullopt;
      }
      bytes.push_back(static_cast<std::uint8_t>(*value));
      i += 2;
    } else {
      return std::nullopt;
    }
  }
  return bytes;
}

/// Takes the next word, up to a blank, and the blank.
std::string_view take_word(std::string_view& line) {
  const std::size_t end = std::min(line.find(' '), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(std::min(end + 1, line.size()));
  return word;
}

std::optional<std::int64_t> parse_count(std::string_view digits, std::int64_t limit) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  const bool whole = error == std::errc{} && end == digits.data() + digits.size();
  return whole && value >= 0 && value <= limit ? std::optional(value) : std::nullopt;
}

/// Seconds with up to nine digits behind the point.
std::optional<std::chrono::nanoseconds> parse_seconds(std::string_view word) {
  const std::size_t point = std::min(word.find('.'), word.size());
  const auto seconds = parse_count(word.substr(0, point), kMaxSeconds);
  std::string fraction(word.substr(std::min(point + 1, word.size())));
  if (!seconds || fraction.size() > 9) {
    return std::nullopt;
  }
  fraction.resize(9, '0');
  const auto ns = parse_count(fraction, kNsPerSecond);
  return ns ? std::optional(std::chrono::nanoseconds(*seconds * kNsPerSecond + *ns)) : std::nullopt;
}

std::optional<WireEvent> find_event(std::string_view word) {
  constexpr std::pair<std::string_view, WireEvent> kWords[] = {{">", WireEvent::kSent},
                                                               {"<", WireEvent::kReceived},
                                                               {"baud", WireEvent::kBaudRate},
                                                               {"break", WireEvent::kBreak},
                                                               {"note", WireEvent::kNote}};
  for (const auto& [known, event] : kWords) {
    if (known == word) {
      return event;
    }
  }
  return std::nullopt;
}

std::variant<WireLogEntry, std::string> parse_entry(std::string_view line) {
  WireLogEntry entry;
  const auto time = parse_seconds(take_word(line));
  const auto event = find_event(take_word(line));
  if (!time) {
    return "expected a time in seconds first, as 1.250000";
  }
  if (!event) {
    return "expected >, <, baud, break or note behind the time";
  }
  entry.time = *time;
  entry.event = *event;
  if (entry.event == WireEvent::kBaudRate) {
    const auto rate = parse_count(line, kMaxBitsPerSecond);
    entry.bits_per_second = static_cast<int>(rate.value_or(0));
    return rate ? std::variant<WireLogEntry, std::string>(entry) : "expected bits per second behind baud";
  }
  auto bytes = unescaped(line);
  if (!bytes) {
    return R"(a \ that is not followed by r, n, \ or x and two hexadecimal digits)";
  }
  if (entry.event == WireEvent::kNote) {
    entry.note.assign(bytes->begin(), bytes->end());
  } else {
    entry.bytes = std::move(*bytes);
  }
  return entry;
}

WireRecord record_of(const WireLogEntry& entry, MonotonicTime began) {
  const Bytes bytes = entry.event == WireEvent::kNote ? as_bytes(entry.note) : Bytes(entry.bytes);
  return {began + entry.time, entry.event, bytes, entry.bits_per_second};
}

}  // namespace

std::variant<WireLog, WireLogFault> parse_wire_log(std::string_view text) {
  WireLog log;
  for (int number = 1; number == 1 || !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (number == 1) {
      if (line != kWireLogTitle) {
        return WireLogFault{1, "expected \"" + std::string(kWireLogTitle) + "\""};
      }
    } else if (line.starts_with('#')) {
      if (log.entries.empty()) {
        log.header.emplace_back(line.substr(line.starts_with("# ") ? 2 : 1));
      }
    } else if (!line.empty()) {
      auto entry = parse_entry(line);
      if (const auto* const why = std::get_if<std::string>(&entry)) {
        return WireLogFault{number, *why};
      }
      log.entries.push_back(std::move(std::get<WireLogEntry>(entry)));
    }
  }
  return log;
}

std::string_view format_wire_record(const WireRecord& record, MonotonicTime began,
                                    std::span<char> room) noexcept {
  Line line(room);
  line.seconds(record.time - began);
  switch (record.event) {
    case WireEvent::kSent:
      line.put(" > ");
      line.escaped(record.bytes);
      break;
    case WireEvent::kReceived:
      line.put(" < ");
      line.escaped(record.bytes);
      break;
    case WireEvent::kBaudRate:
      line.put(" baud ");
      line.number(record.bits_per_second);
      break;
    case WireEvent::kBreak:
      line.put(" break");
      break;
    case WireEvent::kNote:
      line.put(" note ");
      line.escaped(record.bytes);
      break;
  }
  line.put('\n');
  return line.text();
}

std::string format_wire_log(const WireLog& log) {
  std::string text(kWireLogTitle);
  text += '\n';
  for (const std::string& about : log.header) {
    text += "# " + about + '\n';
  }
  std::string room;
  for (const WireLogEntry& entry : log.entries) {
    room.resize(kMaxWireLogLine + 4 * (entry.bytes.size() + entry.note.size()));
    text += format_wire_record(record_of(entry, {}), {}, room);
  }
  return text;
}

std::string format_wire_trace(const WireTrace& trace, std::string_view about) {
  std::string text(kWireLogTitle);
  text += "\n# " + std::string(about) + '\n';
  if (trace.forgotten() > 0) {
    text += "# " + std::to_string(trace.forgotten()) + " earlier records are not kept\n";
  }
  std::optional<MonotonicTime> began;
  std::string room(kMaxWireLogLine, '\0');
  trace.each([&](const WireRecord& record) {
    if (!began) {
      began = record.time;
      text += "# time 0 is CLOCK_MONOTONIC " + std::to_string(to_ns(*began)) + " ns\n";
    }
    text += format_wire_record(record, *began, room);
  });
  return text;
}

}  // namespace tubed::aurora
