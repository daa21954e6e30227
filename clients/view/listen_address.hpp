// Where the page is served.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace tubed {

/// One listening address: an Internet address and a port, or the path of a Unix socket.
struct ListenAddress {
  std::string unix_path;  ///< empty: `address` and `port` count
  std::string address;    ///< "127.0.0.1", "::1", ...
  std::uint16_t port = 0;
  bool is_ipv6 = false;

  /// Only programs of this machine get there.
  [[nodiscard]] bool is_loopback() const;
  /// What a browser writes into "Host" for it, lower case: "127.0.0.1:8080", and "localhost:8080" for a
  /// loopback address. Port 80 may be left out by browsers and is not supported without its number. Empty for
  /// a Unix socket: the proxy in front of it has a name of its own.
  [[nodiscard]] std::vector<std::string> host_names() const;
};

/// `words`: "ADDRESS:PORT" with an IPv4 address, "[ADDRESS]:PORT" with an IPv6 one, or "unix:/PATH". Throws
/// std::invalid_argument, with an example, for anything else.
ListenAddress parse_listen_address(const std::string& words);

}  // namespace tubed
