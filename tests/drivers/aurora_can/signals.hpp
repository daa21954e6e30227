// Fields of a frame as integrators have them: from a .dbc file or from a table of CAN.md. Knows nothing of
// the project's own encoder and decoder, which it judges.
#pragma once

#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <span>
#include <string>
#include <vector>

namespace tubed {

/// A number in little-endian order (Intel), from bit `start` on.
struct Signal {
  std::string name;
  int start = 0;
  int length = 0;
  bool is_signed = false;
  double factor = 1;
  std::string unit;

  [[nodiscard]] double value_in(std::span<const std::uint8_t> bytes) const {
    std::int64_t raw = 0;
    for (int i = 0; i < length; ++i) {
      const int bit = start + i;
      raw |= std::int64_t{bytes[static_cast<std::size_t>(bit / 8)] >> (bit % 8) & 1} << i;
    }
    const bool is_negative = is_signed && (raw >> (length - 1) & 1) != 0;
    return static_cast<double>(is_negative ? raw - (std::int64_t{1} << length) : raw) * factor;
  }

  friend bool operator==(const Signal& a, const Signal& b) {
    return a.name == b.name && a.start == b.start && a.length == b.length && a.is_signed == b.is_signed &&
           std::abs(a.factor - b.factor) <= 1e-12 * a.factor && a.unit == b.unit;
  }
};

struct Message {
  std::string name;
  int size = 0;
  std::vector<Signal> signals;
  std::map<std::string, std::map<int, std::string>> value_tables;  ///< by signal

  /// NaN when there is no such signal.
  [[nodiscard]] double value(const std::string& signal, std::span<const std::uint8_t> bytes) const {
    for (const Signal& one : signals) {
      if (one.name == signal) {
        return one.value_in(bytes);
      }
    }
    return std::nan("");
  }
  /// How many signals each bit belongs to.
  [[nodiscard]] std::vector<int> coverage() const {
    std::vector<int> covered(static_cast<std::size_t>(8 * size));
    for (const Signal& signal : signals) {
      for (int bit = signal.start; bit < signal.start + signal.length; ++bit) {
        ++covered.at(static_cast<std::size_t>(bit));
      }
    }
    return covered;
  }
};

inline std::vector<std::string> lines_of(const std::string& file) {
  std::ifstream stream(file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) {
    lines.push_back(line);
  }
  return lines;
}

/// BO_, SG_ and VAL_ of a .dbc file, by identifier. Signals are unsigned or signed in Intel order, offset 0:
/// anything else is not understood, so that it is missing.
inline std::map<std::uint32_t, Message> read_dbc(const std::string& file) {
  static const std::regex message(R"(BO_ (\d+) (\w+): (\d+) \w+)");
  static const std::regex signal(
      R"x( SG_ (\w+) : (\d+)\|(\d+)@1([+-]) \(([-+.\de]+),0\) \[[^\]]*\] "([^"]*)" \w+)x");
  static const std::regex values(R"x(VAL_ (\d+) (\w+)((?: -?\d+ "[^"]*")+) ;)x");
  static const std::regex value(R"x( (-?\d+) "([^"]*)")x");
  std::map<std::uint32_t, Message> messages;
  Message* newest = nullptr;
  for (const std::string& line : lines_of(file)) {
    std::smatch match;
    if (std::regex_match(line, match, message)) {
      newest = &messages[static_cast<std::uint32_t>(std::stoul(match[1]))];
      newest->name = match[2];
      newest->size = std::stoi(match[3]);
    } else if (newest != nullptr && std::regex_match(line, match, signal)) {
      newest->signals.push_back({match[1], std::stoi(match[2]), std::stoi(match[3]), match[4] == "-",
                                 std::stod(match[5]), match[6]});
    } else if (std::regex_match(line, match, values)) {
      auto& table =
          messages.at(static_cast<std::uint32_t>(std::stoul(match[1]))).value_tables[match[2].str()];
      const std::string entries = match[3];
      for (std::sregex_iterator one(entries.begin(), entries.end(), value); one != std::sregex_iterator();
           ++one) {
        table[std::stoi((*one)[1])] = (*one)[2];
      }
    }
  }
  return messages;
}

}  // namespace tubed
