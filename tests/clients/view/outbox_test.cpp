#include "clients/view/outbox.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

SharedMessage message(MessageKind kind, const std::string& about, std::uint64_t number) {
  auto made = std::make_shared<Message>();
  made->kind = kind;
  made->about = about;
  made->number = number;
  return made;
}
SharedMessage sample(std::uint64_t number, const std::string& about = "cath-1") {
  return message(MessageKind::kEstimate, about, number);
}
SharedMessage image(std::uint64_t number, const std::string& about = "A") {
  return message(MessageKind::kImage, about, number);
}

TEST(Outbox, OfWhatWaitsTheNewestIsSent) {
  Outbox outbox;
  outbox.put(sample(1));
  outbox.put(sample(2));
  EXPECT_EQ(outbox.next()->number, 2U);
  EXPECT_EQ(outbox.next(), nullptr);
}

TEST(Outbox, ATabThatShowsNothingIsSentNoMore) {
  Outbox outbox;
  for (std::uint64_t number = 1; number <= 100; ++number) {
    outbox.put(sample(number));
    const SharedMessage sent = outbox.next();
    EXPECT_EQ(sent != nullptr, number <= Outbox::kMaxEstimates) << number;
  }
  outbox.acknowledge(1);
  EXPECT_EQ(outbox.next()->number, 100U);  // not one of those that it missed
}

TEST(Outbox, OnePictureOfACameraIsOnItsWayAtATime) {
  Outbox outbox;
  outbox.put(image(1));
  EXPECT_EQ(outbox.next()->number, 1U);
  outbox.put(image(2));
  outbox.put(image(3, "B"));
  EXPECT_EQ(outbox.next()->number, 3U);
  EXPECT_EQ(outbox.next(), nullptr);
  outbox.acknowledge(1);
  EXPECT_EQ(outbox.next()->number, 2U);
}

TEST(Outbox, ShapesGoBeforePicturesAndTheRoomBeforeBoth) {
  Outbox outbox;
  outbox.put(image(1));
  outbox.put(sample(2));
  outbox.put(message(MessageKind::kRoom, "room", 3));
  EXPECT_EQ(outbox.next()->number, 3U);
  EXPECT_EQ(outbox.next()->number, 2U);
  EXPECT_EQ(outbox.next()->number, 1U);
}

TEST(Outbox, NoInstrumentStarvesAnother) {
  Outbox outbox;
  outbox.put(sample(2, "cath-1"));
  outbox.put(sample(1, "cath-2"));
  EXPECT_EQ(outbox.next()->about, "cath-2");
}

TEST(Outbox, NumbersThatWereNeverSentAcknowledgeNothing) {
  Outbox outbox;
  for (std::uint64_t number = 1; number <= Outbox::kMaxEstimates; ++number) {
    outbox.put(sample(number));
    static_cast<void>(outbox.next());
  }
  outbox.acknowledge(0);
  outbox.acknowledge(99);
  outbox.put(sample(50));
  EXPECT_EQ(outbox.next(), nullptr);
}

TEST(Outbox, InventedInstrumentsThatCameAndWentLeaveRoomForOthers) {
  Outbox outbox;
  for (std::uint64_t number = 1; number < 100000; ++number) {
    outbox.put(sample(number, "invented-" + std::to_string(number)));
    ASSERT_NE(outbox.next(), nullptr);
  }
}

}  // namespace
}  // namespace tubed
