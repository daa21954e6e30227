#include "idl/interface_filter.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <linux/filter.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <system_error>

namespace tubed {
namespace {

using FilterProgram = std::array<sock_filter, 5>;

constexpr std::uint32_t kWholePacket = 0xffffffff;

/// Classic BPF; the distance of a jump counts from the next instruction.
FilterProgram filter_program(const AllowedInterfaces& allowed) {
  return {{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(SKF_AD_OFF + SKF_AD_IFINDEX)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, allowed.chosen, 2, 0),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, allowed.loopback, 1, 0),
      BPF_STMT(BPF_RET | BPF_K, 0),
      BPF_STMT(BPF_RET | BPF_K, kWholePacket),
  }};
}

bool is_same(const sock_filter& a, const sock_filter& b) {
  return a.code == b.code && a.jt == b.jt && a.jf == b.jf && a.k == b.k;
}

struct FreeAddresses {
  void operator()(ifaddrs* list) const { freeifaddrs(list); }
};
using Addresses = std::unique_ptr<ifaddrs, FreeAddresses>;

Addresses addresses_of_this_machine() {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) {
    throw std::runtime_error(std::string("cannot list the network interfaces: ") + std::strerror(errno));
  }
  return Addresses(list);
}

/// "10.0.0.1" of an address; empty when it has none of the Internet.
std::string text_of(const sockaddr* address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address != nullptr && address->sa_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, address, sizeof(v4));
    inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
  } else if (address != nullptr && address->sa_family == AF_INET6) {
    sockaddr_in6 v6{};
    std::memcpy(&v6, address, sizeof(v6));
    inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
  }
  return text.data();
}

/// Nothing when the descriptor is no UDP socket or not bound.
std::optional<BoundUdpSocket> udp_socket_at(int descriptor) {
  int protocol = 0;
  socklen_t size = sizeof(protocol);
  if (getsockopt(descriptor, SOL_SOCKET, SO_PROTOCOL, &protocol, &size) != 0 || protocol != IPPROTO_UDP) {
    return std::nullopt;
  }
  sockaddr_storage bound{};
  size = sizeof(bound);
  if (getsockname(descriptor, reinterpret_cast<sockaddr*>(&bound), &size) != 0) {
    return std::nullopt;
  }
  sockaddr_in v4{};  // the port stands at the same place in an address of IPv6
  std::memcpy(&v4, &bound, sizeof(v4));
  const std::string address = text_of(reinterpret_cast<const sockaddr*>(&bound));
  const BoundUdpSocket found{.descriptor = descriptor,
                             .port = ntohs(v4.sin_port),
                             .is_everywhere = address == "0.0.0.0" || address == "::"};
  return found.port == 0 ? std::nullopt : std::optional(found);
}

}  // namespace

AllowedInterfaces allowed_interfaces(const std::string& network_interface) {
  const Addresses list = addresses_of_this_machine();
  AllowedInterfaces allowed;
  allowed.chosen = if_nametoindex(network_interface.c_str());
  for (const ifaddrs* entry = list.get(); entry != nullptr; entry = entry->ifa_next) {
    if ((entry->ifa_flags & IFF_LOOPBACK) != 0) {
      allowed.loopback = if_nametoindex(entry->ifa_name);
    }
    if (allowed.chosen == 0 && text_of(entry->ifa_addr) == network_interface) {
      allowed.chosen = if_nametoindex(entry->ifa_name);
    }
  }
  if (allowed.chosen == 0) {
    throw std::runtime_error("no network interface has the name or address '" + network_interface + "'");
  }
  return allowed;
}

std::vector<BoundUdpSocket> bound_udp_sockets() {
  std::vector<BoundUdpSocket> found;
  std::error_code error;
  for (std::filesystem::directory_iterator at("/proc/self/fd", error), end; !error && at != end;
       at.increment(error)) {
    if (const auto udp_socket = udp_socket_at(std::atoi(at->path().filename().c_str()))) {
      found.push_back(*udp_socket);
    }
  }
  if (error) {
    throw std::runtime_error("cannot read /proc/self/fd (" + error.message() + "): mount /proc");
  }
  std::sort(found.begin(), found.end(),
            [](const BoundUdpSocket& a, const BoundUdpSocket& b) { return a.descriptor < b.descriptor; });
  return found;
}

void receive_only_from(int udp_socket, const AllowedInterfaces& allowed) {
  FilterProgram instructions = filter_program(allowed);
  const sock_fprog program{.len = static_cast<unsigned short>(instructions.size()),
                           .filter = instructions.data()};
  if (setsockopt(udp_socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof(program)) != 0) {
    throw std::runtime_error(std::string("the kernel refuses a packet filter (SO_ATTACH_FILTER: ") +
                             std::strerror(errno) + "); let this process's sandbox allow setsockopt");
  }
}

std::optional<AllowedInterfaces> interface_filter_of(int udp_socket) {
  FilterProgram set{};
  socklen_t count = set.size();  // in instructions, not bytes
  if (getsockopt(udp_socket, SOL_SOCKET, SO_GET_FILTER, set.data(), &count) != 0 || count != set.size()) {
    return std::nullopt;
  }
  const AllowedInterfaces allowed{.chosen = set[1].k, .loopback = set[2].k};
  const FilterProgram expected = filter_program(allowed);
  return std::equal(set.begin(), set.end(), expected.begin(), is_same) ? std::optional(allowed)
                                                                       : std::nullopt;
}

}  // namespace tubed
