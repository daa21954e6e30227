#include "drivers/aurora/rate_choice.hpp"

#include <gtest/gtest.h>

namespace tubed::aurora {
namespace {

TEST(RateChoice, IsNeverFasterThanWanted) {
  EXPECT_EQ(RateChoice(BaudRate::k230400).best(), BaudRate::k230400);
  EXPECT_EQ(RateChoice(BaudRate::k9600).best(), BaudRate::k9600);
}

TEST(RateChoice, GoesDownWhenOneIsRefusedAndEndsAt9600) {
  RateChoice choice(BaudRate::k115200);
  choice.refuse(BaudRate::k115200);
  EXPECT_EQ(choice.best(), BaudRate::k57600);
  for (const BaudRate rate : kRates) {
    choice.refuse(rate);
  }
  EXPECT_EQ(choice.best(), BaudRate::k9600);
  choice.forget();
  EXPECT_EQ(choice.best(), BaudRate::k115200);
}

}  // namespace
}  // namespace tubed::aurora
