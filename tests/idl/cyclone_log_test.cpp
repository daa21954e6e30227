#include "idl/cyclone_log.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string_view>

#include "idl/dds_entity.hpp"
#include "tests/support/own_namespace.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

TEST(MessageLimit, AFloodIsCountedAndNotWritten) {
  MessageLimit limit(2, 10 * kSecond_ns);

  EXPECT_EQ(limit.admit("first", 5), "first");
  EXPECT_EQ(limit.admit("second", 6), "second");
  for (int i = 0; i < 1000; ++i) EXPECT_FALSE(limit.admit("more", kSecond_ns + i).has_value());
  EXPECT_EQ(limit.admit("later", 5 + 10 * kSecond_ns), "later (and 1000 messages before it)");
  EXPECT_EQ(limit.admit("then", 6 + 10 * kSecond_ns), "then");
}

TEST(MessageLimit, APeriodBeginsWithItsFirstMessage) {
  MessageLimit limit(1, 10 * kSecond_ns);

  EXPECT_TRUE(limit.admit("a", 100 * kSecond_ns));
  EXPECT_FALSE(limit.admit("b", 109 * kSecond_ns));
  EXPECT_TRUE(limit.admit("c", 111 * kSecond_ns));
  EXPECT_FALSE(limit.admit("d", 120 * kSecond_ns));
}

TEST(MessageLimit, AMessageIsOneLineOfBoundedLength) {
  MessageLimit limit(9, kSecond_ns);

  EXPECT_EQ(limit.admit("one\ntwo \n\n", 0), "one two");
  EXPECT_EQ(limit.admit(std::string(5000, 'x'), 0), std::string(300, 'x') + " ...");
  EXPECT_EQ(limit.admit("", 0), "");
  EXPECT_EQ(limit.admit("a\x1b[2J\xff", 0), "a\uFFFD[2J\uFFFD");
}

class CycloneLogTest : public DdsTest {};

/// A header of RTPS, and a submessage that claims to be longer than the packet.
void send_malformed_packet(int port) {
  constexpr std::string_view kPacket(
      "RTPS\x02\x01\x01\x10"
      "somebodyelse"
      "\x09\x01\xE0\xAC"
      "too short");
  sockaddr_in daemon{};
  daemon.sin_family = AF_INET;
  daemon.sin_port = htons(static_cast<std::uint16_t>(port));
  daemon.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int sender = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sendto(sender, kPacket.data(), kPacket.size(), 0, reinterpret_cast<const sockaddr*>(&daemon),
         sizeof daemon);
  close(sender);
}

int said = 0;  // by Cyclone's one receiving thread

TEST_F(CycloneLogTest, IsLimitedAlsoAfterADomainWasJoinedAndCountsWhatItDoesNotSay) {
  constexpr std::uint64_t kPackets = 100;
  constexpr int kDomain = 7;
  route_cyclone_log(
      {.say = [](std::string_view) { ++said; }, .monotonic_ns = [] { return std::int64_t{1}; }});
  {
    const DdsEntity participant = join_domain(kDomain, "lo");  // which captures the log meanwhile
    for (std::uint64_t sent = 0; sent < kPackets; ++sent) send_malformed_packet(7410 + 250 * kDomain);
    for (int i = 0; i < 500 && cyclone_log_counters().malformed_packets < kPackets; ++i) {
      dds_sleepfor(DDS_MSECS(10));
    }
  }
  EXPECT_EQ(cyclone_log_counters().malformed_packets, kPackets);
  EXPECT_EQ(said, 5);
}

}  // namespace
}  // namespace tubed
