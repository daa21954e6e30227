#include "drivers/aurora/can_identifiers.hpp"

#include <gtest/gtest.h>

#include "drivers/aurora/can_frames.hpp"

namespace tubed::aurora {
namespace {

constexpr auto kStandard = CanIdentifierSize::kStandard;
constexpr auto kExtended = CanIdentifierSize::kExtended;

TEST(CanBase, IsAMultipleOf128ThatFits) {
  for (const std::int64_t good : {0x000, 0x300, 0x680, 0x780}) {
    ASSERT_TRUE(can_base(good, kStandard)) << good;
    EXPECT_EQ(can_base(good, kStandard)->id, good);
  }
  for (const std::int64_t bad : {-0x80, 0x301, 0x340, 0x800}) {
    EXPECT_FALSE(can_base(bad, kStandard)) << bad;
  }
  EXPECT_EQ(can_base(0x18FF'5000, kExtended)->number(), 0x18FF'5000U);
  EXPECT_TRUE(can_base(0x18FF'5000, kExtended)->is_extended());
  EXPECT_TRUE(can_base(0x1FFF'FF80, kExtended));
  EXPECT_FALSE(can_base(0x2000'0000, kExtended));
  EXPECT_FALSE(can_base(0x18FF'5040, kExtended));
}

TEST(CanBase, OfBothSizesWithTheSameNumberAreDifferent) {
  EXPECT_NE(can_base(0x300, kStandard), can_base(0x300, kExtended));
}

TEST(CanBase, KnowsItsBlockAndNoOther) {
  const CanBase base = can_base(0x18FF'5000, kExtended).value();
  EXPECT_EQ(base.place_of(base.status()), CanBase::kStatusAt);
  EXPECT_EQ(base.place_of(base.id + 0x7F), 0x7FU);
  for (const std::uint32_t other : {base.id - 1, base.id + 0x80, base.number(), 0x300U}) {
    EXPECT_FALSE(base.place_of(other)) << std::hex << other;
  }
}

class FramesOfABase : public testing::TestWithParam<CanBase> {};
INSTANTIATE_TEST_SUITE_P(Bases, FramesOfABase,
                         testing::Values(CanBase{0x300}, CanBase{0x680}, CanBase{0x18FF'5000 | kCanExtended},
                                         CanBase{0x300 | kCanExtended}));

// A receiver of one base takes none of another one's frames, whatever they say.
TEST_P(FramesOfABase, AreUnderstoodByListenersOfThatBaseAlone) {
  const CanBase base = GetParam();
  HandleReading reading;
  reading.report = Report::kValid;
  reading.rotation = {1, 0, 0, 0};
  reading.p_em_mm = {1, 2, 3};
  reading.indicator = 0;
  const CanFrame fd = pack_fd_coil(15, reading, {8, 9}, {}, 0, base);
  const CanFrame part = pack_classic_coil(15, reading, {8, 9}, base)[2];
  for (const CanBase listener :
       {CanBase{0x300}, CanBase{0x680}, CanBase{0x18FF'5000 | kCanExtended}, CanBase{0x300 | kCanExtended}}) {
    const bool is_ours = listener == base;
    EXPECT_EQ(unpack_sync(pack_sync({8, 9}, base), listener).has_value(), is_ours);
    EXPECT_EQ(unpack_status(pack_status({}, base), listener).has_value(), is_ours);
    EXPECT_EQ(unpack_follow_up(pack_follow_up({}, base), listener).has_value(), is_ours);
    EXPECT_EQ(unpack_fd_coil(fd, listener).has_value(), is_ours);
    EXPECT_EQ(unpack_classic_part(part, listener).has_value(), is_ours);
  }
  EXPECT_EQ(unpack_fd_coil(fd, base)->coil.coil, 15);
  EXPECT_EQ(unpack_classic_part(part, base)->coil, 15);
  EXPECT_EQ(part.id, base.id + 0x7E);
}

// The check sum runs over the identifier: what a wrong bit has brought to another base is not taken.
TEST_P(FramesOfABase, DoNotPassForThoseOfAnotherWithItsIdentifier) {
  const CanBase other{0x18FF'5080 | kCanExtended};
  CanFrame moved = pack_status({}, GetParam());
  moved.id = other.status();
  EXPECT_FALSE(unpack_status(moved, other));
}

}  // namespace
}  // namespace tubed::aurora
