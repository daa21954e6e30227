// What Linux knows of a network interface, by its name.
#pragma once

#include <string>

namespace tubed {

struct NetworkInterface {
  int index = 0;
  int hardware = 0;  ///< ARPHRD_CAN, ARPHRD_LOOPBACK, ...
  bool is_up = false;
  int mtu_bytes = 0;
};

/// 0, or errno: ENODEV when there is none of that name, EPERM or EAFNOSUPPORT where AF_NETLINK is forbidden.
/// Does not allocate. Asks by RTM_GETLINK (rtnetlink(7)): the ioctls of netdevice(7), and if_nametoindex(),
/// start modprobe for a name that is not there if the caller is root, and wait for it beyond every deadline
/// and signal.
int find_network_interface(const std::string& name, NetworkInterface& found) noexcept;

}  // namespace tubed
