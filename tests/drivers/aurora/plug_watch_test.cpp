#include "drivers/aurora/plug_watch.hpp"

#include <gtest/gtest.h>

namespace tubed::aurora {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr MonotonicTime kStart = from_ns(5'000'000'000);
constexpr SystemStatus kUnplugged{0x0080};
constexpr SystemStatus kReplugged{0x00C0};  // recorded

TEST(PlugWatch, LooksWhenAPlugIsPutInWhileACoilIsAbsent) {
  PlugWatch plugs;
  EXPECT_FALSE(plugs.look({.status = {}}, kStart));
  EXPECT_FALSE(plugs.look({.coil_absent = true, .status = kUnplugged}, kStart + seconds(1)));
  EXPECT_TRUE(plugs.look({.coil_absent = true, .status = kReplugged}, kStart + seconds(2)));
}

TEST(PlugWatch, LooksWhenAHandleComesThatTheSetupDidNotMeet) {
  PlugWatch plugs;
  EXPECT_TRUE(plugs.look({.coil_absent = true, .newcomer = true}, kStart));
}

TEST(PlugWatch, DoesNotLookForAStrangersToolWhileAllCoilsAreThere) {
  PlugWatch plugs;
  EXPECT_FALSE(plugs.look({.status = {}}, kStart));
  EXPECT_FALSE(plugs.look({.newcomer = true, .status = kReplugged}, kStart + seconds(1)));
}

// A tracker that says "occupied" for good, with a tool that cannot be initialised.
TEST(PlugWatch, DoesNotLookForATrackerThatGoesOnSayingOccupied) {
  PlugWatch plugs;
  for (int i = 0; i < 10'000; ++i) {
    EXPECT_FALSE(plugs.look({.coil_absent = true, .status = kReplugged}, kStart + i * milliseconds(25)));
  }
}

TEST(PlugWatch, LooksEverMoreSeldomWhenThatDoesNotHelp) {
  PlugWatch plugs;
  int looks = 0;
  for (int i = 0; i < 60 * 40; ++i) {  // a minute
    const bool looked = plugs.look({.coil_absent = true, .newcomer = true}, kStart + i * milliseconds(25));
    looks += looked ? 1 : 0;
    if (looked) {
      plugs.start();
    }
  }
  EXPECT_EQ(looks, 5);  // at 0, 2, 6, 14, 30 s
}

}  // namespace
}  // namespace tubed::aurora
