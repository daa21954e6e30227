#include "clients/exporter/http_server.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <stdexcept>
#include <system_error>

namespace tubed {

namespace {

constexpr timeval kClientPatience{1, 0};
constexpr std::size_t kLongestRequest = 8192;

std::string response(const char* status, const char* type, const std::string& body) {
  return "HTTP/1.1 " + std::string(status) + "\r\nContent-Type: " + type +
         "\r\nContent-Length: " + std::to_string(body.size()) + "\r\nConnection: close\r\n\r\n" + body;
}

sockaddr_in address_of(const std::string& where) {
  const std::size_t colon = where.rfind(':');
  sockaddr_in address{};
  address.sin_family = AF_INET;
  std::uint16_t port = 0;
  const char* const end = where.data() + where.size();
  const char* const first = where.data() + (colon == std::string::npos ? where.size() : colon + 1);
  const auto [last, error] = std::from_chars(first, end, port);
  const bool has_port = first != end && last == end && error == std::errc();
  if (!has_port || inet_pton(AF_INET, where.substr(0, colon).c_str(), &address.sin_addr) != 1) {
    throw std::invalid_argument("\"" + where + "\" is not ADDRESS:PORT, such as 127.0.0.1:9756");
  }
  address.sin_port = htons(port);
  return address;
}

/// Until the end of the headers, of the client's patience, or of ours.
std::string read_request(int client) {
  std::string request;
  std::array<char, 1024> piece{};
  while (request.size() < kLongestRequest && request.find("\r\n\r\n") == std::string::npos) {
    const ssize_t length = recv(client, piece.data(), piece.size(), 0);
    if (length <= 0) break;
    request.append(piece.data(), static_cast<std::size_t>(length));
  }
  return request;
}

void write_all(int client, const std::string& answer) {
  std::size_t written = 0;
  while (written < answer.size()) {
    const ssize_t length = send(client, answer.data() + written, answer.size() - written, MSG_NOSIGNAL);
    if (length <= 0) return;
    written += static_cast<std::size_t>(length);
  }
}

}  // namespace

std::string answer_to(const std::string& request, const std::function<std::string()>& text) {
  const std::string line = request.substr(0, request.find("\r\n"));
  const std::size_t first = line.find(' ');
  const std::size_t second = first == std::string::npos ? first : line.find(' ', first + 1);
  if (second == std::string::npos || !line.substr(second + 1).starts_with("HTTP/1.")) {
    return response("400 Bad Request", "text/plain", "not understood\n");
  }
  if (line.substr(0, first) != "GET") {
    return response("405 Method Not Allowed", "text/plain", "GET only\n");
  }
  std::string path = line.substr(first + 1, second - first - 1);
  path = path.substr(0, path.find('?'));
  if (path == "/metrics") {
    return response("200 OK", "text/plain; version=0.0.4; charset=utf-8", text());
  }
  return path == "/" ? response("200 OK", "text/html", "<a href=\"/metrics\">metrics</a> of tubed\n")
                     : response("404 Not Found", "text/plain", "there is /metrics\n");
}

HttpServer::HttpServer(const std::string& where) {
  const sockaddr_in address = address_of(where);
  socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int yes = 1;
  setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (socket_ < 0 || bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(socket_, 8) != 0) {
    const int error = errno;
    close(socket_);
    throw std::system_error(error, std::generic_category(), "cannot listen on " + where);
  }
}

HttpServer::~HttpServer() { close(socket_); }

void HttpServer::serve(std::chrono::milliseconds patience, const std::function<std::string()>& text) const {
  pollfd waiting{socket_, POLLIN, 0};
  if (poll(&waiting, 1, static_cast<int>(patience.count())) <= 0) {
    return;
  }
  const int client = accept4(socket_, nullptr, nullptr, SOCK_CLOEXEC);
  if (client < 0) {
    return;
  }
  setsockopt(client, SOL_SOCKET, SO_RCVTIMEO, &kClientPatience, sizeof kClientPatience);
  setsockopt(client, SOL_SOCKET, SO_SNDTIMEO, &kClientPatience, sizeof kClientPatience);
  write_all(client, answer_to(read_request(client), text));
  shutdown(client, SHUT_RDWR);
  close(client);
}

}  // namespace tubed
