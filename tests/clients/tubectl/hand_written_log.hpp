// Conversations with an Aurora put together by hand, a turn at a time; check sums come from the protocol.
#pragma once

#include <array>
#include <chrono>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/tubectl/check/wire_conversation.hpp"
#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/command.hpp"
#include "drivers/aurora/reply.hpp"
#include "drivers/aurora/tx_reply.hpp"
#include "drivers/aurora/wire_log.hpp"

namespace tubed {

inline aurora::HandleReading pose_of(int handle, std::uint32_t frame) {
  aurora::HandleReading reading;
  reading.handle = static_cast<std::uint8_t>(handle);
  reading.report = aurora::Report::kValid;
  reading.rotation = {0.8, 0.6, 0, 0};
  reading.p_em_mm = {10, 20, -200};
  reading.indicator = 0.1;
  reading.port_status.bits = 0x3F;
  reading.frame = frame;
  return reading;
}

inline aurora::HandleReading without_pose(int handle, aurora::Report report, std::uint32_t frame = 0) {
  aurora::HandleReading reading;
  reading.handle = static_cast<std::uint8_t>(handle);
  reading.report = report;
  reading.port_status.bits = report == aurora::Report::kMissing ? 0x3FU : 0U;
  reading.frame = frame;
  return reading;
}

/// Time goes on by 50 ms a command and 10 ms a reply unless told otherwise.
class HandWrittenLog {
 public:
  HandWrittenLog& wait(std::chrono::nanoseconds time) {
    time_ += time;
    return *this;
  }
  HandWrittenLog& baud(int bits_per_second) {
    log_.entries.push_back({time_, aurora::WireEvent::kBaudRate, {}, bits_per_second, ""});
    return *this;
  }
  HandWrittenLog& serial_break() {
    log_.entries.push_back({time_, aurora::WireEvent::kBreak, {}, 0, ""});
    return *this;
  }
  HandWrittenLog& send(std::string_view bytes) {
    add(aurora::WireEvent::kSent, bytes);
    return *this;
  }
  HandWrittenLog& receive(std::string_view bytes) {
    add(aurora::WireEvent::kReceived, bytes);
    return *this;
  }
  HandWrittenLog& ask(std::string_view name, std::string_view parameters = "") {
    return wait(std::chrono::milliseconds(50)).send(aurora::with_crc(name, parameters).text());
  }
  HandWrittenLog& answer(std::string_view payload) {
    return wait(std::chrono::milliseconds(10)).receive(with_check_sum(payload));
  }
  /// The first half of a reply, a command, and the rest of that reply.
  HandWrittenLog& answer_around(std::string_view payload, std::string_view name,
                                std::string_view parameters) {
    const std::string bytes = with_check_sum(payload);
    wait(std::chrono::milliseconds(10)).receive(bytes.substr(0, bytes.size() / 2));
    send(aurora::with_crc(name, parameters).text());
    return wait(std::chrono::milliseconds(1)).receive(bytes.substr(bytes.size() / 2));
  }
  /// A BX reply.
  HandWrittenLog& measure(const std::vector<aurora::HandleReading>& readings, std::uint16_t system = 0) {
    std::array<std::uint8_t, aurora::kMaxBxFrame> room{};
    aurora::TrackingReply reply;
    reply.handle_count = static_cast<int>(readings.size());
    std::copy(readings.begin(), readings.end(), reply.handles.begin());
    reply.system_status.bits = system;
    const std::size_t size = aurora::encode_bx(reply, room);
    return wait(std::chrono::milliseconds(10)).receive(aurora::as_text(aurora::Bytes(room).first(size)));
  }
  /// `count` times BX at 40 a second, one coil, `step` counts each.
  HandWrittenLog& track(std::uint32_t frame, int count, std::uint32_t step = 8) {
    for (int i = 0; i < count; ++i, frame += step) {
      wait(std::chrono::milliseconds(15)).send(aurora::bx_command(1).text());
      measure({pose_of(0x0A, frame)});
    }
    return *this;
  }

  [[nodiscard]] const aurora::WireLog& log() const { return log_; }
  [[nodiscard]] WireConversation conversation() const { return read_conversation(log_); }

 private:
  static std::string with_check_sum(std::string_view payload) {
    std::array<std::uint8_t, 4096> room{};
    const std::size_t size = aurora::encode_text_reply(payload, room);
    return std::string(aurora::as_text(aurora::Bytes(room).first(size)));
  }
  void add(aurora::WireEvent event, std::string_view bytes) {
    log_.entries.push_back({time_, event, {bytes.begin(), bytes.end()}, 0, ""});
  }

  aurora::WireLog log_;
  std::chrono::nanoseconds time_{};
};

}  // namespace tubed
