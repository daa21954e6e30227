// The source's two halves at a pseudo-terminal: wait() waits, read() talks.
#include <gtest/gtest.h>

#include "drivers/aurora_serial/aurora_serial_driver.hpp"
#include "drivers/aurora_serial/aurora_serial_source.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/laboratory/aurora_emulator/pseudo_terminal.hpp"

namespace tubed {
namespace {

using std::chrono::milliseconds;

RoomDescription one_coil() {
  InstrumentDescription catheter;
  catheter.coils.push_back({1, 10.0, false, 1, 0});
  RoomDescription room;
  room.instruments = {catheter};
  return room;
}

DriverSettings default_settings() {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : aurora_serial_settings()) {
    values[setting.name] = setting.default_value;
  }
  return DriverSettings(std::move(values));
}

TEST(AuroraSerialSource, WaitingOpensNothingSendsNothingAndTakesNothing) {
  aurora::emulator::PseudoTerminal terminal("");
  AuroraSerialSource source(one_coil(), default_settings(), terminal.path());
  EmFrame frame;
  ASSERT_TRUE(source.open().ok);
  std::vector<std::uint8_t> said;
  const auto wait = [&] {
    source.wait(monotonic_now() + milliseconds(20));
    terminal.read(said);
  };
  wait();
  EXPECT_TRUE(said.empty());
  EXPECT_FALSE(source.session().exchange().attached()) << "nobody has opened the port";
  EXPECT_EQ(source.read(frame), ReadOutcome::kNothing);
  terminal.read(said);
  EXPECT_FALSE(said.empty()) << "the first question";
  said.clear();
  for (int i = 0; i < 20; ++i) {
    wait();
  }
  EXPECT_TRUE(said.empty());
  terminal.write(aurora::as_bytes("OKAYA896\r"));
  for (int i = 0; i < 20; ++i) {
    wait();
  }
  EXPECT_EQ(source.session().exchange().counts().replies, 0U);
  source.read(frame);
  EXPECT_EQ(source.session().exchange().counts().replies, 1U);
}

}  // namespace
}  // namespace tubed
