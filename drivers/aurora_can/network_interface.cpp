#include "drivers/aurora_can/network_interface.hpp"

#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "drivers/aurora_can/last_error.hpp"

namespace tubed {

namespace {

/// RTM_GETLINK of one name; the attribute follows the header directly.
struct Question {
  nlmsghdr header{};
  ifinfomsg interface {};
  rtattr attribute{};
  std::array<char, IFNAMSIZ> name{};

  explicit Question(const std::string& wanted) noexcept {
    header.nlmsg_len = sizeof(Question);
    header.nlmsg_type = RTM_GETLINK;
    header.nlmsg_flags = NLM_F_REQUEST;
    interface.ifi_family = AF_UNSPEC;
    attribute.rta_len = static_cast<unsigned short>(sizeof attribute + name.size());
    attribute.rta_type = IFLA_IFNAME;
    std::memcpy(name.data(), wanted.data(), wanted.size());
  }
};
static_assert(sizeof(Question) == NLMSG_LENGTH(sizeof(ifinfomsg)) + RTA_LENGTH(IFNAMSIZ),
              "no gaps on the wire");

/// Room for what the kernel tells of an interface, statistics and all: 1 to 2 kB.
struct Answer {
  alignas(nlmsghdr) std::array<char, 16384> bytes;
  int size = 0;
};

int read_answer(const Answer& answer, NetworkInterface& found) noexcept {
  const auto* header = reinterpret_cast<const nlmsghdr*>(answer.bytes.data());
  if (!NLMSG_OK(header, static_cast<unsigned>(answer.size))) {
    return EPROTO;
  }
  if (header->nlmsg_type == NLMSG_ERROR && header->nlmsg_len >= NLMSG_LENGTH(sizeof(nlmsgerr))) {
    const int error = -static_cast<const nlmsgerr*>(NLMSG_DATA(header))->error;
    return error > 0 ? error : EPROTO;
  }
  if (header->nlmsg_type != RTM_NEWLINK || header->nlmsg_len < NLMSG_LENGTH(sizeof(ifinfomsg))) {
    return EPROTO;
  }
  const auto* interface = static_cast<const ifinfomsg*>(NLMSG_DATA(header));
  found = {interface->ifi_index, interface->ifi_type, (interface->ifi_flags & IFF_UP) != 0, 0};
  auto left = static_cast<int>(IFLA_PAYLOAD(header));
  for (const rtattr* attribute = IFLA_RTA(interface); RTA_OK(attribute, left);
       attribute = RTA_NEXT(attribute, left)) {
    if (attribute->rta_type == IFLA_MTU && RTA_PAYLOAD(attribute) == sizeof found.mtu_bytes) {
      std::memcpy(&found.mtu_bytes, RTA_DATA(attribute), sizeof found.mtu_bytes);
    }
  }
  return 0;
}

int ask(int descriptor, const Question& question, Answer& answer) noexcept {
  // The kernel has answered when send() returns.
  if (::send(descriptor, &question, sizeof question, 0) != static_cast<ssize_t>(sizeof question)) {
    return last_error();
  }
  const ssize_t size = ::recv(descriptor, answer.bytes.data(), answer.bytes.size(), MSG_DONTWAIT);
  answer.size = static_cast<int>(size);
  return size < 0 ? last_error() : 0;
}

}  // namespace

int find_network_interface(const std::string& name, NetworkInterface& found) noexcept {
  if (name.empty() || name.size() >= IFNAMSIZ) {
    return ENODEV;
  }
  const int descriptor = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (descriptor < 0) {
    return last_error();
  }
  Answer answer;
  const int error = ask(descriptor, Question(name), answer);
  ::close(descriptor);
  return error != 0 ? error : read_answer(answer, found);
}

}  // namespace tubed
