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

TEST(CoilMap, ComparesOfAnExpectedToolOnlyWhatIsGiven) {
  RoomDescription room;
  room.instruments.resize(1);
  room.instruments[0].coils = {
      {1, 10, false, 1, 0, 0x3C4B0001U, ""}, {2, 20, false, 1, 1, {}, "610029"}, {3, 30, false, 2, 0}};
  const CoilMap map(room);
  EXPECT_TRUE(map.expected(0).matches(0x3C4B0001, "whatever"));
  EXPECT_FALSE(map.expected(0).matches(0x3C4B0002, "whatever"));
  EXPECT_TRUE(map.expected(1).matches(7, "610029"));
  EXPECT_FALSE(map.expected(1).matches(7, "610028"));
  EXPECT_TRUE(map.expected(2).matches(0, ""));
}

}  // namespace
}  // namespace tubed::aurora
