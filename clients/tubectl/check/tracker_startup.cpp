#include "clients/tubectl/check/tracker_startup.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

#include "drivers/aurora/command.hpp"
#include "drivers/aurora/port_replies.hpp"
#include "drivers/aurora/reply.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kUntilAnAnswer{12};  // all rates, a break and its RESET
constexpr seconds kAfterAnAnswer{12};  // INIT, COMM, all questions, TSTART
constexpr seconds kPerHandle{4};       // PINIT 2.6 s, PHINF, PENA
constexpr milliseconds kPerBlock{400};

/// Takes in one record after the other.
class StartupReader {
 public:
  void take(const aurora::WireRecord& record) {
    switch (record.event) {
      case aurora::WireEvent::kSent:
        sent(aurora::as_text(record.bytes));
        break;
      case aurora::WireEvent::kReceived:
        received(aurora::as_text(record.bytes), record.time);
        break;
      case aurora::WireEvent::kBaudRate:
        baud_ = record.bits_per_second;
        break;
      case aurora::WireEvent::kBreak:
        startup_.doing = "a serial break, so that the tracker starts anew";
        break;
      case aurora::WireEvent::kNote:
        break;
    }
  }
  [[nodiscard]] TrackerStartup result() && { return std::move(startup_); }

 private:
  void sent(std::string_view line) {
    answer_.clear();
    const auto command = aurora::parse_command(line.substr(0, line.find('\r')));
    if (!command) {
      return;
    }
    name_ = command->name;
    parameters_ = command->parameters;
    startup_.blocks_written += name_ == "PVWR" ? 1 : 0;
    if (const std::string words = describe(); !words.empty()) {
      startup_.doing = words;
    }
  }

  void received(std::string_view bytes, MonotonicTime time) {
    answer_ += bytes;
    if (!answer_.ends_with('\r')) {
      return;
    }
    const auto reply = aurora::decode_text_reply(std::string_view(answer_).substr(0, answer_.size() - 1));
    if (!reply) {
      return;
    }
    startup_.answered_at = startup_.answered_at.value_or(time);
    if (reply->kind == aurora::ReplyKind::kError) {
      ++startup_.errors[{name_, reply->error_code}];
    } else if (name_ == "PHSR" && parameters_ == "02") {
      take_list(reply->text());
    }
  }

  void take_list(std::string_view text) {
    listed_.clear();
    if (const auto list = aurora::parse_handle_list(text)) {
      for (const aurora::HandleStatus& entry : list->entries()) {
        listed_.push_back(entry.handle);
        startup_.handles.insert(entry.handle);
      }
    }
  }

  [[nodiscard]] std::string describe() const {
    const std::string handle = " of handle " + parameters_.substr(0, 2);
    if (name_ == "PINIT") return name_ + handle + place_in_list();
    if (name_ == "PVWR") return "writing the tool definition" + handle;
    if (name_ == "INIT") return "INIT at " + std::to_string(baud_) + " baud";
    if (name_ == "COMM") return "COMM: another rate of the line";
    if (name_ == "APIREV" || name_ == "VER") return "asking for the firmware";
    if (name_ == "PHSR" || name_ == "PHF") return "asking what is plugged in";
    if (name_ == "PHINF" || name_ == "PENA" || name_ == "PDIS") return "asking where each tool is plugged in";
    if (name_ == "TSTART") return "TSTART: tracking starts, 1.6 s";
    if (name_ == "TSTOP") return "TSTOP: it was tracking";
    if (name_ == "BX" || name_ == "TX") return name_ + ": measuring";
    return "";
  }

  [[nodiscard]] std::string place_in_list() const {
    for (std::size_t i = 0; i < listed_.size(); ++i) {
      std::array<char, 3> digits{};
      std::snprintf(digits.data(), digits.size(), "%02X", static_cast<unsigned>(listed_[i]));
      if (parameters_.starts_with(digits.data())) {
        return ", " + std::to_string(i + 1) + " of " + std::to_string(listed_.size());
      }
    }
    return "";
  }

  TrackerStartup startup_;
  std::string name_;  ///< of the command that waits for its reply
  std::string parameters_;
  std::string answer_;
  std::vector<std::uint8_t> listed_;
  int baud_ = 9600;
};

}  // namespace

MonotonicTime TrackerStartup::deadline(MonotonicTime began) const {
  const MonotonicTime from = answered_at ? *answered_at + kAfterAnAnswer : began + kUntilAnAnswer;
  return from + kPerHandle * handles.size() + kPerBlock * blocks_written;
}

std::string TrackerStartup::error_text() const {
  std::string text;
  for (const auto& [what, count] : errors) {
    std::array<char, 16> code{};
    std::snprintf(code.data(), code.size(), "ERROR%02X", static_cast<unsigned>(what.second));
    text += (text.empty() ? "" : ", ") + std::string(code.data()) + " to " + what.first +
            (count > 1 ? " (" + std::to_string(count) + " times)" : "");
  }
  return text;
}

TrackerStartup read_startup(const aurora::WireTrace& trace) {
  StartupReader reader;
  trace.each([&](const aurora::WireRecord& record) { reader.take(record); });
  return std::move(reader).result();
}

}  // namespace tubed
