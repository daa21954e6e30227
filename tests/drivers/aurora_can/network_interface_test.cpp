#include "drivers/aurora_can/network_interface.hpp"

#include <gtest/gtest.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace tubed {
namespace {

/// What netdevice(7) says of the loopback interface.
ifreq asked_by_ioctl(unsigned long what) {
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ifreq request{};
  std::strcpy(request.ifr_name, "lo");
  EXPECT_EQ(::ioctl(descriptor, what, &request), 0) << std::strerror(errno);
  ::close(descriptor);
  return request;
}

TEST(NetworkInterface, IsWhatTheIoctlsSay) {
  NetworkInterface found;
  ASSERT_EQ(find_network_interface("lo", found), 0);
  EXPECT_EQ(found.index, static_cast<int>(::if_nametoindex("lo")));
  EXPECT_EQ(found.hardware, ARPHRD_LOOPBACK);
  EXPECT_EQ(found.mtu_bytes, asked_by_ioctl(SIOCGIFMTU).ifr_mtu);
  EXPECT_EQ(found.is_up, (asked_by_ioctl(SIOCGIFFLAGS).ifr_flags & IFF_UP) != 0);
}

TEST(NetworkInterface, OfNoSuchNameIsSaidNotToBeThere) {
  const std::string longest(IFNAMSIZ - 1, 'x');
  for (const std::string& name : {std::string(), std::string("nosuchcan"), longest, longest + "y"}) {
    NetworkInterface found;
    EXPECT_EQ(find_network_interface(name, found), ENODEV) << '"' << name << '"';
    EXPECT_EQ(found.index, 0);
  }
}

}  // namespace
}  // namespace tubed
