// tubed_aurora.dbc against the encoder: what that sends, a decoder that has only the file gives back.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "drivers/aurora/can_frames.hpp"
#include "drivers/aurora/checksums.hpp"
#include "tests/drivers/aurora/drawn_replies.hpp"
#include "tests/drivers/aurora_can/signals.hpp"

namespace tubed {
namespace {

using aurora::CanFrame;

constexpr int kDrawn = 200;

class Dbc : public testing::Test {
 protected:
  double value(const CanFrame& frame, const std::string& signal) {
    return messages.at(frame.id).value(signal, frame.payload());
  }
  static std::string coil_signal(int coil, const std::string& name) {
    return "Coil" + std::to_string(coil) + "_" + name;
  }

  std::map<std::uint32_t, Message> messages =
      read_dbc(TUBED_SOURCE_DIR "/drivers/aurora_can/tubed_aurora.dbc");
  std::mt19937 random{11};
};

TEST_F(Dbc, HasAMessageForEachFrameOfTheClassicLayoutAndNoOther) {
  const aurora::CanBase base;
  std::set<std::uint32_t> expected{base.sync(), base.status(), base.follow_up()};
  for (int coil = 0; coil < aurora::kMaxCanCoils; ++coil) {
    for (int part = 0; part < aurora::kClassicParts; ++part) {
      expected.insert(base.classic_part(coil, part));
    }
  }
  std::set<std::uint32_t> found;
  for (const auto& [id, message] : messages) {
    found.insert(id);
  }
  EXPECT_EQ(found, expected);
}

TEST_F(Dbc, GivesEachBitToOneSignal) {
  for (const auto& [id, message] : messages) {
    EXPECT_EQ(message.size, 8) << message.name;
    EXPECT_EQ(message.coverage(), std::vector<int>(64, 1)) << message.name;
  }
}

TEST_F(Dbc, UnderstandsSyncAndFollowUp) {
  for (int n = 0; n < kDrawn; ++n) {
    const aurora::CanSync sync{static_cast<std::uint32_t>(random()), static_cast<std::uint32_t>(random())};
    const CanFrame frame = pack_sync(sync);
    EXPECT_EQ(value(frame, "TrackerFrame"), sync.frame);
    EXPECT_EQ(value(frame, "MeasuredTime"), sync.time_us);
    const CanFrame follow_up = aurora::pack_follow_up({aurora::can_sequence(sync.frame), sync.time_us});
    EXPECT_EQ(value(follow_up, "SentTime"), sync.time_us);
    EXPECT_EQ(value(follow_up, "Sequence"), sync.frame / 8 % 256);
    EXPECT_EQ(value(follow_up, "Reserved"), 0);
    EXPECT_EQ(value(follow_up, "Crc8"), aurora::can_crc8(follow_up.id, follow_up.payload().first(7)));
  }
}

TEST_F(Dbc, UnderstandsEachBitOfStatus) {
  for (int n = 0; n < kDrawn; ++n) {
    aurora::CanStatus sent;
    sent.coil_count = static_cast<int>(random() % 17);
    sent.system_status.bits = static_cast<std::uint16_t>(random());
    sent.ports_present = static_cast<std::uint16_t>(random());
    sent.gateway_error = static_cast<std::uint8_t>(random());
    const CanFrame frame = pack_status(sent);
    EXPECT_EQ(value(frame, "Protocol"), 16);
    EXPECT_EQ(value(frame, "CoilCount"), sent.coil_count);
    EXPECT_EQ(value(frame, "PortsPresent"), sent.ports_present);
    EXPECT_EQ(value(frame, "TrackerState"), static_cast<int>(sent.tracker_state()));
    EXPECT_EQ(value(frame, "Emulated"), sent.is_simulated());
    const aurora::SystemStatus& system = sent.system_status;
    EXPECT_EQ(value(frame, "SynchronisationError"), system.synchronisation_error());
    EXPECT_EQ(value(frame, "SystemProcessingException"), system.processing_exception());
    EXPECT_EQ(value(frame, "PortBecameOccupied"), system.port_became_occupied());
    EXPECT_EQ(value(frame, "PortBecameUnoccupied"), system.port_became_unoccupied());
    EXPECT_EQ(value(frame, "DiagnosticPending"), system.diagnostic_pending());
    EXPECT_EQ(value(frame, "TemperatureOutOfRange"), system.temperature_out_of_range());
    EXPECT_EQ(value(frame, "HardwareChanged"), system.hardware_changed());
  }
}

TEST_F(Dbc, UnderstandsTheClassicFramesOfEachCoil) {
  aurora::DrawnReplies drawn(9);
  for (int n = 0; n < kDrawn; ++n) {
    const int coil = n % aurora::kMaxCanCoils;
    const aurora::HandleReading sent = drawn.reply(1, 8).handles[0];
    const aurora::CanSync sync{static_cast<std::uint32_t>(8 * random()), 0};
    const auto frames = pack_classic_coil(coil, sent, sync);
    const auto part = [&frames](int i) {
      return unpack_classic_part(frames[static_cast<std::size_t>(i)]).value();
    };
    const aurora::CanCoil joined = aurora::join_classic_parts({part(0), part(1), part(2)}).value();
    for (int i = 0; i < 3; ++i) {
      const CanFrame& frame = frames[static_cast<std::size_t>(i)];
      const std::string number = std::to_string(i);
      EXPECT_EQ(value(frame, coil_signal(coil, "State" + number)), static_cast<int>(joined.state));
      EXPECT_EQ(value(frame, coil_signal(coil, "Sequence" + number)), sync.frame / 8 % 16);
      EXPECT_EQ(value(frame, coil_signal(coil, "Crc8_" + number)), frame.bytes[7]);
    }
    const auto flag = [&](const char* name) { return value(frames[1], coil_signal(coil, name)) == 1; };
    EXPECT_EQ(flag("OutOfVolume"), sent.port_status.out_of_volume());
    EXPECT_EQ(flag("PartlyOutOfVolume"), sent.port_status.partly_out_of_volume());
    EXPECT_EQ(flag("CoilBroken"), sent.port_status.coil_broken());
    EXPECT_EQ(flag("ProcessingException"), sent.port_status.processing_exception());
    EXPECT_EQ(flag("Occupied"), sent.port_status.occupied());
    EXPECT_EQ(flag("Initialised"), sent.port_status.initialised());
    EXPECT_EQ(flag("Enabled"), sent.port_status.enabled());
    if (joined.state != aurora::CanCoilState::kValid) {
      continue;
    }
    const Eigen::Vector3d p_em_mm(value(frames[0], coil_signal(coil, "X")),
                                  value(frames[0], coil_signal(coil, "Y")),
                                  value(frames[1], coil_signal(coil, "Z")));
    const Eigen::Vector3d axis_em(value(frames[2], coil_signal(coil, "AxisX")),
                                  value(frames[2], coil_signal(coil, "AxisY")),
                                  value(frames[2], coil_signal(coil, "AxisZ")));
    EXPECT_LT((p_em_mm - sent.p_em_mm).cwiseAbs().maxCoeff(), 0.00051);
    EXPECT_LT((axis_em - aurora::coil_axis(sent.rotation)).norm(), 0.002);
    EXPECT_NEAR(value(frames[1], coil_signal(coil, "Indicator")), sent.indicator, 0.00006);
  }
}

TEST_F(Dbc, NamesEachStateOfATrackerAndOfACoil) {
  const auto& tracker = messages.at(aurora::CanBase{}.status()).value_tables.at("TrackerState");
  EXPECT_EQ(tracker.size(), static_cast<std::size_t>(aurora::CanTrackerState::kGatewayEnds) + 1);
  const std::map<int, std::string> states{{0, "disabled"}, {1, "valid"}, {2, "missing"}};
  const std::map<int, std::string> flags{{0, "no"}, {1, "yes"}};
  for (int coil = 0; coil < aurora::kMaxCanCoils; ++coil) {
    for (int part = 0; part < aurora::kClassicParts; ++part) {
      const auto& tables = messages.at(aurora::CanBase{}.classic_part(coil, part)).value_tables;
      EXPECT_EQ(tables.at(coil_signal(coil, "State" + std::to_string(part))), states);
      EXPECT_EQ(tables.size(), part == 1 ? 8U : 1U);
    }
    const auto& second = messages.at(aurora::CanBase{}.classic_part(coil, 1)).value_tables;
    EXPECT_EQ(second.at(coil_signal(coil, "CoilBroken")), flags);
  }
}

TEST_F(Dbc, HasTablesAndCommentsOfSignalsThatAreThere) {
  static const std::regex about(R"((?:VAL_|CM_ SG_) (\d+) (\w+) .*)");
  int found = 0;
  for (const std::string& line : lines_of(TUBED_SOURCE_DIR "/drivers/aurora_can/tubed_aurora.dbc")) {
    std::smatch match;
    if (std::regex_match(line, match, about)) {
      const auto& signals = messages.at(static_cast<std::uint32_t>(std::stoul(match[1]))).signals;
      EXPECT_TRUE(std::any_of(signals.begin(), signals.end(), [&match](const Signal& one) {
        return one.name == match[2];
      })) << line;
      ++found;
    }
  }
  EXPECT_GT(found, 16 * 10);
}

}  // namespace
}  // namespace tubed
