#include "idl/interface_filter.hpp"

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "tests/support/own_namespace.hpp"

namespace tubed {
namespace {

constexpr int kPort = 7410;
constexpr unsigned kAnother = 4711;  // an interface that does not exist

/// A socket bound to every address, as Cyclone's are.
class BoundSocket {
 public:
  BoundSocket() : descriptor_(socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    const sockaddr_in everywhere = at(INADDR_ANY);
    EXPECT_EQ(bind(descriptor_, reinterpret_cast<const sockaddr*>(&everywhere), sizeof(everywhere)), 0);
  }
  ~BoundSocket() { close(descriptor_); }
  BoundSocket(const BoundSocket&) = delete;
  BoundSocket& operator=(const BoundSocket&) = delete;
  [[nodiscard]] int get() const { return descriptor_; }

  /// Does a packet that is sent to it through lo arrive?
  [[nodiscard]] bool hears_loopback() const {
    const sockaddr_in here = at(INADDR_LOOPBACK);
    char octet = 1;
    EXPECT_EQ(sendto(descriptor_, &octet, 1, 0, reinterpret_cast<const sockaddr*>(&here), sizeof(here)), 1);
    return recv(descriptor_, &octet, 1, 0) == 1;
  }

 private:
  static sockaddr_in at(in_addr_t address) {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_addr.s_addr = htonl(address);
    place.sin_port = htons(kPort);
    return place;
  }
  int descriptor_;
};

class InterfaceFilter : public DdsTest {
 protected:
  const unsigned lo_ = if_nametoindex("lo");
};

TEST_F(InterfaceFilter, LetsInTheChosenInterface) {
  const BoundSocket bound;
  receive_only_from(bound.get(), {.chosen = lo_, .loopback = kAnother});
  EXPECT_TRUE(bound.hears_loopback());
}

TEST_F(InterfaceFilter, LetsInProgramsOfThisHostBesideTheChosenInterface) {
  const BoundSocket bound;
  receive_only_from(bound.get(), {.chosen = kAnother, .loopback = lo_});
  EXPECT_TRUE(bound.hears_loopback());
}

TEST_F(InterfaceFilter, DropsWhatComesThroughAnotherInterface) {
  const BoundSocket bound;
  EXPECT_TRUE(bound.hears_loopback());
  receive_only_from(bound.get(), {.chosen = kAnother, .loopback = kAnother + 1});
  EXPECT_FALSE(bound.hears_loopback());
}

TEST_F(InterfaceFilter, IsReadBackFromTheSocket) {
  const BoundSocket bound;
  EXPECT_EQ(interface_filter_of(bound.get()), std::nullopt);
  const AllowedInterfaces allowed{.chosen = kAnother, .loopback = lo_};
  receive_only_from(bound.get(), allowed);
  EXPECT_EQ(interface_filter_of(bound.get()), allowed);
}

TEST_F(InterfaceFilter, ABoundSocketIsFoundWithItsPort) {
  const BoundSocket bound;
  const std::vector<BoundUdpSocket> found = bound_udp_sockets();
  const auto at = std::find_if(found.begin(), found.end(),
                               [&](const BoundUdpSocket& one) { return one.descriptor == bound.get(); });
  ASSERT_NE(at, found.end());
  EXPECT_EQ(at->port, kPort);
  EXPECT_TRUE(at->is_everywhere);
}

TEST_F(InterfaceFilter, AnInterfaceHasANameOrAnAddress) {
  const AllowedInterfaces lo{.chosen = lo_, .loopback = lo_};
  EXPECT_EQ(allowed_interfaces("lo"), lo);
  EXPECT_EQ(allowed_interfaces("127.0.0.1"), lo);
  EXPECT_THROW(allowed_interfaces("192.0.2.1"), std::runtime_error);
}

TEST_F(InterfaceFilter, ASocketThatIsNoneIsRefused) {
  EXPECT_THROW(receive_only_from(-1, {.chosen = lo_, .loopback = lo_}), std::runtime_error);
}

}  // namespace
}  // namespace tubed
