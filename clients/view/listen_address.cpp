#include "clients/view/listen_address.hpp"

#include <arpa/inet.h>
#include <sys/un.h>

#include <charconv>
#include <stdexcept>
#include <string_view>

namespace tubed {

namespace {

constexpr std::string_view kUnix = "unix:";

[[noreturn]] void refuse(const std::string& words) {
  throw std::invalid_argument(
      "\"" + words +
      "\" is no address to listen on; expected ADDRESS:PORT such as 127.0.0.1:8080 or "
      "[::1]:8080, or unix:/run/tubed-view/page.sock");
}

bool parse_port(std::string_view words, std::uint16_t& port) {
  const auto [end, error] = std::from_chars(words.data(), words.data() + words.size(), port);
  return !words.empty() && error == std::errc() && end == words.data() + words.size() && port != 0;
}

bool is_address(int family, const std::string& words) {
  in6_addr parsed{};
  return inet_pton(family, words.c_str(), &parsed) == 1;
}

}  // namespace

bool ListenAddress::is_loopback() const {
  return !unix_path.empty() || address == "::1" || (!is_ipv6 && address.starts_with("127."));
}

std::vector<std::string> ListenAddress::host_names() const {
  if (!unix_path.empty()) return {};
  const std::string with_port = ":" + std::to_string(port);
  std::vector<std::string> names{(is_ipv6 ? "[" + address + "]" : address) + with_port};
  if (is_loopback()) names.push_back("localhost" + with_port);
  return names;
}

ListenAddress parse_listen_address(const std::string& words) {
  ListenAddress parsed;
  if (words.starts_with(kUnix)) {
    parsed.unix_path = words.substr(kUnix.size());
    if (!parsed.unix_path.starts_with('/') || parsed.unix_path.size() >= sizeof(sockaddr_un::sun_path)) {
      refuse(words);
    }
    return parsed;
  }
  const std::size_t colon = words.rfind(':');
  if (colon == std::string::npos || !parse_port(std::string_view(words).substr(colon + 1), parsed.port)) {
    refuse(words);
  }
  parsed.address = words.substr(0, colon);
  parsed.is_ipv6 = parsed.address.size() > 2 && parsed.address.front() == '[' && parsed.address.back() == ']';
  if (parsed.is_ipv6) parsed.address = parsed.address.substr(1, parsed.address.size() - 2);
  if (!is_address(parsed.is_ipv6 ? AF_INET6 : AF_INET, parsed.address)) refuse(words);
  return parsed;
}

}  // namespace tubed
