#include "clients/tubectl/check/anonymous_wire_log.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <string>

#include "clients/tubectl/check/wire_conversation.hpp"
#include "drivers/aurora/command.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMinSerial = 4;

bool is_alphanumeric(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

void blank(char& c) { c = is_alphanumeric(c) ? '0' : c; }

void insert_serial(std::set<std::string>& serials, std::string_view serial) {
  const bool says_something =
      std::any_of(serial.begin(), serial.end(), [](char c) { return is_alphanumeric(c) && c != '0'; });
  if (serial.size() >= kMinSerial && says_something) {
    serials.emplace(serial);
  }
}

/// PHINF: field 0001 comes first and has the tool's serial at 23, field 0020 last with that of the control
/// unit at its beginning.
void find_in_tool(const WireTurn& turn, std::set<std::string>& serials) {
  constexpr std::size_t kToolSize = 33;
  constexpr std::size_t kSerialAt = 23;
  constexpr std::size_t kSerialSize = 8;
  constexpr std::size_t kLocationSize = 14;
  const std::string_view text = turn.reply->payload;
  const auto fields = turn.parameters.size() == 6 ? aurora::parse_hex(turn.parameters.substr(2)) : 1U;
  if (fields && (*fields & aurora::kToolField) != 0 && text.size() >= kToolSize) {
    insert_serial(serials, text.substr(kSerialAt, kSerialSize));
  }
  if (fields && (*fields & aurora::kLocationField) != 0 && text.size() >= kLocationSize) {
    insert_serial(serials, text.substr(text.size() - kLocationSize, kSerialSize));
  }
}

/// VER: the words with a digit on a line that speaks of a serial number.
void find_in_version(std::string_view text, std::set<std::string>& serials) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string line(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    std::string lower(line);
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (lower.find("serial") == std::string::npos && lower.find("s/n") == std::string::npos) {
      continue;
    }
    std::size_t at = 0;
    while ((at = line.find_first_not_of(" :=,;\t", at)) != std::string::npos) {
      const std::size_t after = std::min(line.find_first_of(" :=,;\t", at), line.size());
      const std::string word = line.substr(at, after - at);
      if (std::any_of(word.begin(), word.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) {
        insert_serial(serials, word);
      }
      at = after;
    }
  }
}

bool tells_serials(const WireTurn& turn) { return turn.name == "PHINF" || turn.name == "VER"; }

std::set<std::string> serials_in(const WireConversation& conversation) {
  std::set<std::string> serials;
  for (const WireTurn& turn : conversation.turns) {
    if (!turn.reply || turn.reply->kind != aurora::ReplyKind::kText) {
      continue;
    }
    if (turn.name == "PHINF") {
      find_in_tool(turn, serials);
    } else if (turn.name == "VER") {
      find_in_version(turn.reply->payload, serials);
    }
  }
  return serials;
}

bool blank_serials(std::string& text, const std::set<std::string>& serials) {
  bool has_changed = false;
  for (const std::string& serial : serials) {
    for (std::size_t at = text.find(serial); at != std::string::npos; at = text.find(serial, at + 1)) {
      std::for_each(text.begin() + static_cast<std::ptrdiff_t>(at),
                    text.begin() + static_cast<std::ptrdiff_t>(at + serial.size()), blank);
      has_changed = true;
    }
  }
  return has_changed;
}

std::string as_sent(const std::string& payload) {
  std::string line(payload.size() + 5, '\0');
  line.resize(
      aurora::encode_text_reply(payload, {reinterpret_cast<std::uint8_t*>(line.data()), line.size()}));
  return line;
}

/// All bytes from the tracker, one behind the other.
std::string received_bytes(const aurora::WireLog& log) {
  std::string stream;
  for (const aurora::WireLogEntry& entry : log.entries) {
    if (entry.event == aurora::WireEvent::kReceived) {
      stream.append(entry.bytes.begin(), entry.bytes.end());
    }
  }
  return stream;
}

void replace_received_bytes(aurora::WireLog& log, std::string_view stream) {
  for (aurora::WireLogEntry& entry : log.entries) {
    if (entry.event == aurora::WireEvent::kReceived) {
      std::copy_n(stream.begin(), entry.bytes.size(), entry.bytes.begin());
      stream.remove_prefix(entry.bytes.size());
    }
  }
}

/// What came between the question of a damaged turn and the next command.
void blank_damaged_answers(aurora::WireLog& log, const WireConversation& conversation) {
  std::size_t turn = 0;
  for (aurora::WireLogEntry& entry : log.entries) {
    if (entry.event == aurora::WireEvent::kSent) {
      ++turn;
    } else if (entry.event == aurora::WireEvent::kReceived && turn > 0) {
      const WireTurn& asked = conversation.turns[turn - 1];
      if (tells_serials(asked) && !asked.reply) {
        for (std::uint8_t& byte : entry.bytes) {
          byte = std::isalnum(byte) != 0 ? '0' : byte;
        }
      }
    }
  }
}

}  // namespace

aurora::WireLog without_serial_numbers(aurora::WireLog log) {
  const WireConversation conversation = read_conversation(log);
  const std::set<std::string> serials = serials_in(conversation);
  std::string stream = received_bytes(log);
  std::size_t at = 0;
  for (const WireTurn& turn : conversation.turns) {
    if (!turn.reply || turn.reply->kind != aurora::ReplyKind::kText) {
      continue;
    }
    const std::string before = as_sent(turn.reply->payload);
    std::string payload = turn.reply->payload;
    const std::size_t found = stream.find(before, at);
    if (found == std::string::npos) {
      continue;
    }
    at = found + before.size();
    if (blank_serials(payload, serials)) {
      stream.replace(found, before.size(), as_sent(payload));
    }
  }
  blank_serials(stream, serials);
  replace_received_bytes(log, stream);
  blank_damaged_answers(log, conversation);
  return log;
}

}  // namespace tubed
