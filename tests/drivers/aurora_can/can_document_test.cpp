// CAN.md is what other people's listeners are written from: its tables and test vectors against the .dbc file
// and the encoder.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "drivers/aurora/can_frames.hpp"
#include "tests/drivers/aurora/hex_bytes.hpp"
#include "tests/drivers/aurora_can/signals.hpp"

namespace tubed {
namespace {

using aurora::CanBase;
using aurora::CanFrame;

const char* const kDocument = TUBED_SOURCE_DIR "/drivers/aurora_can/CAN.md";

/// The tables of fields, by the heading above them.
std::map<std::string, Message> read_tables() {
  static const std::regex heading("### (\\w+)");
  static const std::regex row(
      R"(\| (\w+) \| (\d+) \| (\d+) \| (\d+) \| (signed|unsigned) \| ([./\d]+) \| (\w*) \| .*)");
  std::map<std::string, Message> tables;
  std::string newest;
  for (const std::string& line : lines_of(kDocument)) {
    std::smatch match;
    if (std::regex_match(line, match, heading)) {
      newest = match[1];
    } else if (std::regex_match(line, match, row)) {
      const std::string factor = match[6];
      tables[newest].signals.push_back({match[1], 8 * std::stoi(match[2]) + std::stoi(match[3]),
                                        std::stoi(match[4]), match[5] == "signed",
                                        factor == "1/32767" ? 1.0 / 32767 : std::stod(factor), match[7]});
    }
  }
  return tables;
}

struct Vector {
  CanFrame frame;
  std::vector<std::pair<std::string, double>> values;
};

std::vector<Vector> read_vectors() {
  static const std::regex frame(R"(([0-9A-F]{3}|[0-9A-F]{8})(#|##5)([0-9A-F]+))");
  std::vector<Vector> vectors;
  bool is_inside = false;
  for (const std::string& line : lines_of(kDocument)) {
    std::smatch match;
    if (line.rfind("```", 0) == 0) {
      is_inside = line == "```vectors";
    } else if (is_inside && std::regex_match(line, match, frame)) {
      const auto bytes = aurora::bytes_of(match[3].str());
      Vector one;
      one.frame.id = static_cast<std::uint32_t>(std::stoul(match[1], nullptr, 16)) |
                     (match[1].length() == 8 ? aurora::kCanExtended : 0);
      one.frame.size = static_cast<std::uint8_t>(bytes.size());
      std::copy(bytes.begin(), bytes.end(), one.frame.bytes.begin());
      EXPECT_EQ(match[2] == "##5", bytes.size() > 8) << line;
      vectors.push_back(one);
    } else if (is_inside) {
      std::istringstream words(line);
      for (std::string word; words >> word;) {
        const std::size_t equals = word.find('=');
        vectors.back().values.emplace_back(word.substr(0, equals), std::stod(word.substr(equals + 1)));
      }
    }
  }
  return vectors;
}

CanBase base_of(const CanFrame& frame) { return CanBase{frame.id & ~(CanBase::kBlock - 1)}; }

/// The table that a frame's identifier leads to.
std::string heading_of(const CanFrame& frame) {
  const std::uint32_t place = frame.id & (CanBase::kBlock - 1);
  if (place >= CanBase::kClassicCoilAt) {
    return std::array{"COIL_XY", "COIL_Z", "COIL_AXIS"}.at(place % 4);
  }
  return place >= CanBase::kFdCoilAt ? "COIL" : std::array{"SYNC", "STATUS", "FOLLOW_UP"}.at(place);
}

class CanDocument : public testing::Test {
 protected:
  std::map<std::string, Message> tables = read_tables();
  std::vector<Vector> vectors = read_vectors();
};

TEST_F(CanDocument, HasTheTablesOfTheDbcFile) {
  const auto dbc = read_dbc(TUBED_SOURCE_DIR "/drivers/aurora_can/tubed_aurora.dbc");
  const CanBase base;
  const auto expect_same = [&](const char* table, std::uint32_t id, const std::string& prefix) {
    std::vector<Signal> expected = dbc.at(id).signals;
    for (Signal& one : expected) {
      one.name.erase(0, prefix.size());
    }
    EXPECT_EQ(tables.at(table).signals, expected) << table;
  };
  expect_same("SYNC", base.sync(), "");
  expect_same("STATUS", base.status(), "");
  expect_same("FOLLOW_UP", base.follow_up(), "");
  expect_same("COIL_XY", base.classic_part(0, 0), "Coil0_");
  expect_same("COIL_Z", base.classic_part(0, 1), "Coil0_");
  expect_same("COIL_AXIS", base.classic_part(0, 2), "Coil0_");
}

TEST_F(CanDocument, GivesEachBitOfAnFdFrameToOneField) {
  tables.at("COIL").size = 48;
  EXPECT_EQ(tables.at("COIL").coverage(), std::vector<int>(8 * 48, 1));
}

TEST_F(CanDocument, HasVectorsThatTheTablesDecodeToTheirValues) {
  ASSERT_GT(vectors.size(), 12U);
  for (const Vector& vector : vectors) {
    const Message& table = tables.at(heading_of(vector.frame));
    EXPECT_FALSE(vector.values.empty()) << std::hex << vector.frame.id;
    for (const auto& [name, value] : vector.values) {
      EXPECT_NEAR(table.value(name, vector.frame.payload()), value, 0.6e-6)
          << std::hex << vector.frame.id << " " << name;
    }
  }
}

// Of every kind of frame there is one, and the driver takes them all: check sums of both sizes of
// identifiers.
TEST_F(CanDocument, HasVectorsThatTheDriverUnderstands) {
  std::map<std::string, int> seen;
  for (const Vector& vector : vectors) {
    const CanFrame& frame = vector.frame;
    const CanBase base = base_of(frame);
    EXPECT_TRUE(unpack_sync(frame, base) || unpack_status(frame, base) || unpack_follow_up(frame, base) ||
                unpack_fd_coil(frame, base) || unpack_classic_part(frame, base))
        << std::hex << frame.id;
    ++seen[heading_of(frame)];
  }
  EXPECT_EQ(seen.size(), tables.size());
}

TEST_F(CanDocument, HasVectorsThatTheGatewaySends) {
  aurora::HandleReading reading;  // as in can_frames_test: one sample of a real tracker
  reading.report = aurora::Report::kValid;
  reading.rotation = {0.8157, -0.0068, 0.5783, 0};
  reading.p_em_mm = {-49.31, 57.13, -159.05};
  reading.indicator = 0;
  reading.port_status.bits = 0x3F;
  const aurora::CanSync sync{0x18, 75'000};
  std::vector<CanFrame> sent;
  for (const CanBase base : {CanBase{}, CanBase{0x18FF'5000 | aurora::kCanExtended}}) {
    sent.push_back(pack_sync(sync, base));
    sent.push_back(pack_fd_coil(0, reading, sync, {}, 0x3318FC10, base));
    for (const CanFrame& part : pack_classic_coil(0, reading, sync, base)) {
      sent.push_back(part);
    }
  }
  const auto is_in_document = [this](const CanFrame& frame) {
    return std::any_of(vectors.begin(), vectors.end(), [&frame](const Vector& one) {
      return one.frame.id == frame.id && one.frame.bytes == frame.bytes;
    });
  };
  EXPECT_EQ(std::count_if(sent.begin(), sent.end(), is_in_document), 5 + 2);  // not all with 29 bits
}

}  // namespace
}  // namespace tubed
