#include "drivers/driver_registry/driver_registry.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace tubed {
namespace {

std::map<std::string, SettingValue> defaults_of(const DriverDescription& driver) {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : driver.settings) {
    values.emplace(setting.name, setting.default_value);
  }
  return values;
}

RoomDescription room_with_one_camera() {
  RoomDescription room;
  room.cameras.push_back(
      {.name = "A", .width = 400, .height = 600, .fx = 2000, .fy = 2000, .cx = 200, .cy = 300});
  room.instruments.push_back({.id = "cath-1", .coils = {{.sensor = 1, .offset_from_tip_mm = 10}}});
  return room;
}

TEST(DriverRegistry, HasReplayAndSimulationForTrackerAndFluoroscope) {
  for (const char* name : {"replay", "simulation"}) {
    const DriverDescription* driver = find_driver(drivers(), name);

    ASSERT_NE(driver, nullptr) << name;
    EXPECT_TRUE(driver->make_em_source) << name;
    EXPECT_TRUE(driver->make_image_source) << name;
  }
}

TEST(DriverRegistry, NothingButADeviceCallsItselfADevice) {
  EXPECT_EQ(find_driver(drivers(), "replay")->origin, Origin::kReplayed);
  EXPECT_EQ(find_driver(drivers(), "simulation")->origin, Origin::kSimulated);
}

TEST(DriverRegistry, HasTheDriversOfItsFoldersInTheOrderOfMessages) {
  std::vector<std::string> names;
  for (const DriverDescription& driver : drivers()) {
    names.push_back(driver.name);
  }
  names.resize(5);  // those with a place: others come behind them

  EXPECT_EQ(names,
            (std::vector<std::string>{"aurora-serial", "aurora-can", "replay", "image_shm", "simulation"}));
}

TEST(DriverRegistry, AnUnknownNameIsNoDriver) { EXPECT_EQ(find_driver(drivers(), "Replay"), nullptr); }

TEST(DriverRegistry, EverySettingHasANameOfItsOwnAndAMeaning) {
  for (const DriverDescription& driver : drivers()) {
    std::set<std::string> names;
    for (const KeyDescription& setting : driver.settings) {
      EXPECT_TRUE(names.insert(setting.name).second) << driver.name << "." << setting.name;
      EXPECT_FALSE(setting.meaning.empty()) << driver.name << "." << setting.name;
      EXPECT_LE(setting.minimum, setting.maximum) << driver.name << "." << setting.name;
    }
  }
}

TEST(DriverRegistry, TheSimulationRunsOnItsDefaults) {
  const RoomDescription room = room_with_one_camera();
  const DriverDescription& simulation = *find_driver(drivers(), "simulation");
  const SourceContext context{room, DriverSettings(defaults_of(simulation)), "", ""};

  const auto em = simulation.make_em_source(context);
  const auto images = simulation.make_image_source(context, 0);

  ASSERT_NE(em, nullptr);
  ASSERT_NE(images, nullptr);
  EXPECT_TRUE(em->open().ok);
  EXPECT_TRUE(images->open().ok);
}

TEST(DriverRegistry, ARecordingIsLookedForBesideTheFileThatNamesIt) {
  const RoomDescription room = room_with_one_camera();
  const DriverDescription& replay = *find_driver(drivers(), "replay");
  auto values = defaults_of(replay);
  values["folder"] = std::string("../recordings/nothing_here");
  const SourceContext context{room, DriverSettings(values), "", "/no/such/room/etc"};

  const OpenResult opened = replay.make_em_source(context)->open();

  EXPECT_FALSE(opened.ok);
  EXPECT_NE(opened.why.find("/no/such/room/recordings/nothing_here"), std::string::npos) << opened.why;
}

TEST(DriverRegistry, AnAbsoluteFolderStaysWhereItIs) {
  const RoomDescription room = room_with_one_camera();
  const DriverDescription& replay = *find_driver(drivers(), "replay");
  auto values = defaults_of(replay);
  values["folder"] = std::string("/no/such/recording");
  const SourceContext context{room, DriverSettings(values), "", "/etc/tubed"};

  const OpenResult opened = replay.make_em_source(context)->open();

  EXPECT_NE(opened.why.find("/no/such/recording"), std::string::npos) << opened.why;
  EXPECT_EQ(opened.why.find("/etc/tubed"), std::string::npos) << opened.why;
}

}  // namespace
}  // namespace tubed
