// Cyclone binds its UDP sockets to every address of the machine, whatever interface it was given. A packet
// filter on each socket makes the kernel drop what came through another interface. Needs no privilege.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tubed {

/// Kernel indices of the interfaces whose packets are let in. Programs of this host reach each other through
/// the loopback interface even when they use the address of another one; no other host can use it.
struct AllowedInterfaces {
  unsigned chosen = 0;
  unsigned loopback = 0;
  bool operator==(const AllowedInterfaces&) const = default;
};

/// The interface of that name or address ("lo", "eth1", "192.168.7.2"), and the loopback interface.
/// Throws std::runtime_error when there is no such interface.
AllowedInterfaces allowed_interfaces(const std::string& network_interface);

/// A UDP socket of this process that the kernel delivers packets to.
struct BoundUdpSocket {
  int descriptor = -1;
  int port = 0;
  bool is_everywhere = false;  ///< bound to 0.0.0.0 or [::], not to one address of this machine
};

/// All of them, by descriptor. Throws std::runtime_error when /proc does not show the process its
/// descriptors.
std::vector<BoundUdpSocket> bound_udp_sockets();

/// From now on `udp_socket` receives from these interfaces only; what it holds already stays. The index of an
/// interface that is removed and comes back is another one: its packets are dropped.
/// Throws std::runtime_error when the kernel refuses.
void receive_only_from(int udp_socket, const AllowedInterfaces& allowed);

/// What receive_only_from() has set on a socket; nothing when it has no filter, or one of somebody else.
std::optional<AllowedInterfaces> interface_filter_of(int udp_socket);

}  // namespace tubed
