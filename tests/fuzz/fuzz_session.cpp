// A whole session with a tracker whose answers are the input, in virtual time: the search for the rate, the
// setup of ports, tracking, the loss of the line. Every command is answered by the next piece of the input:
// one byte that says how, and what it needs. Trackers that answer as they should are among the corpus.
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "drivers/aurora/bx_reply.hpp"
#include "drivers/aurora/checksums.hpp"
#include "drivers/aurora/session.hpp"
#include "tests/fuzz/fuzz_input.hpp"

using namespace tubed;
using namespace tubed::aurora;
using namespace tubed::fuzz;

namespace {

void append_sealed(std::vector<std::uint8_t>& line, std::string_view text) {
  line.insert(line.end(), text.begin(), text.end());
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  const std::uint16_t sum = crc16(as_bytes(text));
  for (int shift = 12; shift >= 0; shift -= 4) {
    line.push_back(static_cast<std::uint8_t>(kDigits[sum >> shift & 15U]));
  }
  line.push_back('\r');
}

/// The tracker that the input is.
class ScriptedChannel final : public ByteChannel {
 public:
  explicit ScriptedChannel(FuzzInput& input) : input_(input) {}

  MonotonicTime now() noexcept override { return now_; }
  bool write(Bytes bytes) noexcept override {
    static_cast<void>(bytes);
    answer();
    return !gone_;
  }
  Arrival read(std::span<std::uint8_t> room, MonotonicTime deadline) noexcept override {
    if (gone_) {
      return {0, true};
    }
    if (waiting_.empty() || arrives_ > deadline) {
      now_ = std::max(now_, deadline);
      return {};
    }
    now_ = std::max(now_, arrives_);
    const std::size_t count = std::min(room.size(), waiting_.size());
    std::copy_n(waiting_.begin(), count, room.begin());
    waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
    return {count, false};
  }
  bool knows_baud(int bits_per_second) noexcept override { return bits_per_second <= 921600; }
  bool set_baud(int bits_per_second) noexcept override {
    static_cast<void>(bits_per_second);
    waiting_.clear();
    return !gone_;
  }
  bool send_break() noexcept override {
    now_ += std::chrono::milliseconds(250);
    answer();
    return !gone_;
  }

 private:
  void answer() {
    if (input_.empty()) {
      return;
    }
    const std::uint8_t how = input_.take<std::uint8_t>();
    arrives_ = now_ + std::chrono::milliseconds(how >> 4U);
    switch (how & 15U) {
      case 0:  // nothing
        break;
      case 1:
        append_sealed(waiting_, "OKAY");
        break;
      case 2:
        append_sealed(waiting_, "RESET");
        break;
      case 3:  // the line is gone
        gone_ = true;
        break;
      case 4: {  // bytes as they are
        const auto bytes = input_.take_bytes(input_.take<std::uint8_t>());
        waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
        break;
      }
      case 5:  // a measurement that keeps its form
        append_measurement();
        break;
      default:  // a text with its right check sum
        append_sealed(waiting_, input_.take_text(input_.take<std::uint8_t>()));
    }
  }

  void append_measurement() {
    TrackingReply reply;
    reply.handle_count = input_.take<std::uint8_t>() % (kMaxHandles + 1);
    reply.system_status.bits = input_.take<std::uint16_t>();
    for (int i = 0; i < reply.handle_count; ++i) {
      HandleReading& reading = reply.handles[static_cast<std::size_t>(i)];
      reading.handle = input_.take<std::uint8_t>();
      reading.report = input_.take<std::uint8_t>() % 2 == 0 ? Report::kValid : Report::kMissing;
      reading.port_status.bits = 0x3F;
      reading.frame = input_.take<std::uint16_t>();
      reading.rotation = {1, 0, 0, 0};
      reading.p_em_mm = {1, 2, -100};
      reading.indicator = 0.1;
    }
    std::array<std::uint8_t, 4096> room{};
    const std::size_t size = encode_bx(reply, room);
    waiting_.insert(waiting_.end(), room.begin(), room.begin() + static_cast<std::ptrdiff_t>(size));
  }

  FuzzInput& input_;
  MonotonicTime now_{std::chrono::seconds(1000)};
  MonotonicTime arrives_{};
  std::vector<std::uint8_t> waiting_;
  bool gone_ = false;
};

void check(const EmFrame& frame, MonotonicTime now) {
  demand(frame.coil_count >= 0 && frame.coil_count <= kMaxTrackerCoils);
  demand(frame.measured <= now + std::chrono::seconds(1));
  for (const CoilSample& coil : frame.coils) {
    const bool has_pose = coil.p_em_mm.allFinite() && std::abs(coil.tangent_em.norm() - 1) < 1e-6;
    demand(coil.status != CoilStatus::kOk || has_pose);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  FuzzInput input(data, size);
  const std::uint8_t flags = input.take<std::uint8_t>();
  CoilMap map;
  for (int sensor = 1; sensor <= flags % 8 + 1; ++sensor) {
    map.place(sensor, {(sensor + 1) / 2, (sensor + 1) % 2});
  }
  const auto rom = input.take_bytes((flags & 8U) != 0 ? input.take<std::uint8_t>() : 0);
  const std::vector<std::uint8_t> tool(rom.begin(), rom.end());
  const std::array<ToolDefinition, 1> tools{{{1, tool}}};
  Session session({.baud = BaudRate::k115200, .poller = {}, .trace_capacity = 4096}, map,
                  std::span(tools).first(tool.empty() ? 0 : 1));
  ScriptedChannel channel(input);
  session.attach(channel);
  EmFrame frame;
  for (int slices = 0; slices < 400 && !input.empty(); ++slices) {
    const auto event = session.run(channel.now() + std::chrono::milliseconds(100), frame);
    if (event == Session::Event::kMeasurement) {
      check(frame, channel.now());
    } else if (event == Session::Event::kGone) {
      break;
    }
    static_cast<void>(session.describe());
    static_cast<void>(session.missing());
    static_cast<void>(session.notes());
  }
  session.close();
  return 0;
}
