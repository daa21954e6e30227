#include "drivers/aurora/coil_map.hpp"

#include <gtest/gtest.h>

namespace tubed::aurora {
namespace {

TEST(CoilMap, ComesFromTheCoilsOfAllInstruments) {
  RoomDescription room;
  room.instruments.resize(2);
  room.instruments[0].coils = {{1, 10, false, 1, 0}, {4, 20, false, 1, 1}};
  room.instruments[1].coils = {{2, 10, false, 3, 0}, {3, 20, false}};
  const CoilMap map(room);
  EXPECT_EQ(map.coil_count(), 4);
  EXPECT_EQ(map.plug(0), (CoilPlug{1, 0}));
  EXPECT_EQ(map.plug(1), (CoilPlug{3, 0}));
  EXPECT_EQ(map.plug(2), std::nullopt);
  EXPECT_EQ(map.coil_at({1, 1}), 3);
  EXPECT_EQ(map.coil_at({2, 0}), std::nullopt);
  EXPECT_EQ(map.coil_at({0, 0}), std::nullopt);
}

TEST(CoilMap, IgnoresSensorsThatCannotBe) {
  CoilMap map;
  map.place(0, {1, 0});
  map.place(kMaxTrackerCoils + 1, {1, 1});
  EXPECT_EQ(map.coil_count(), 0);
  EXPECT_EQ(map.plug(-1), std::nullopt);
}

TEST(CoilMap, SaysNothingWhenNothingIsMissing) {
  CoilMap map;
  map.place(1, {1, 0});
  const std::array found = {CoilPlug{1, 0}, CoilPlug{2, 0}};
  EXPECT_TRUE(describe_missing(map, found).empty());
}

TEST(CoilMap, NamesWhatIsMissingAndWhatIsThereInstead) {
  CoilMap map;
  map.place(1, {1, 0});
  map.place(2, {1, 1});
  const std::array found = {CoilPlug{1, 0}, CoilPlug{2, 0}};
  EXPECT_EQ(
      describe_missing(map, found).text(),
      "not plugged in or not usable: sensor 2 (port 1 channel 1); plugged in instead: port 2 channel 0");
  EXPECT_EQ(
      describe_missing(map, {}).text(),
      "not plugged in or not usable: sensor 1 (port 1 channel 0), sensor 2 (port 1 channel 1); nothing is "
      "plugged in");
}

}  // namespace
}  // namespace tubed::aurora
