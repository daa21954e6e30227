#include "clients/exporter/http_server.hpp"

#include <arpa/inet.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <list>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace tubed {

namespace {

using Time = std::chrono::steady_clock::time_point;

constexpr std::chrono::seconds kMaxConnectionTime{2};
constexpr std::size_t kMaxConnections = 64;
// Beyond it the library does not accept: room for those that have been told to go and have not gone yet.
constexpr unsigned kMaxAccepted = 2 * kMaxConnections;
constexpr std::size_t kMaxRequestBytes = 8192;
constexpr int kBacklog = 128;

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

/// A listening socket.
int listen_on(const std::string& where) {
  const sockaddr_in address = address_of(where);
  const int listening = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int yes = 1;
  setsockopt(listening, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (listening < 0 || bind(listening, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      listen(listening, kBacklog) != 0) {
    const int error = errno;
    close(listening);
    throw std::system_error(error, std::generic_category(), "cannot listen on " + where);
  }
  return listening;
}

}  // namespace

HttpAnswer answer_to(std::string_view method, std::string_view path,
                     const std::function<std::string()>& text) {
  if (method != "GET" && method != "HEAD") return {405, "text/plain", "GET only\n"};
  if (path == "/metrics") return {200, "text/plain; version=0.0.4; charset=utf-8", text()};
  if (path == "/") return {200, "text/html", "<a href=\"/metrics\">metrics</a> of tubed\n"};
  return {404, "text/plain", "there is /metrics\n"};
}

/// libmicrohttpd, driven by the thread that calls serve(): it reads, parses and writes without ever waiting
/// for one client. It knows idle time only, which a byte a second never exceeds: how long a connection lives
/// is watched here.
class HttpServer::Library {
 public:
  Library(const std::string& where, std::function<std::string()> text)
      : text_(std::move(text)),
        daemon_(MHD_start_daemon(MHD_USE_EPOLL, 0, nullptr, nullptr, &handle, this,  //
                                 MHD_OPTION_LISTEN_SOCKET, listen_on(where),         //
                                 MHD_OPTION_CONNECTION_LIMIT, kMaxAccepted,          //
                                 MHD_OPTION_CONNECTION_MEMORY_LIMIT, kMaxRequestBytes,
                                 MHD_OPTION_NOTIFY_CONNECTION, &notice, this, MHD_OPTION_END)) {
    if (daemon_ == nullptr) throw std::runtime_error("cannot start an HTTP server on " + where);
  }
  ~Library() { MHD_stop_daemon(daemon_); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  void serve(std::chrono::milliseconds timeout) {
    pollfd waiting{MHD_get_daemon_info(daemon_, MHD_DAEMON_INFO_EPOLL_FD)->epoll_fd, POLLIN, 0};
    MHD_UNSIGNED_LONG_LONG library_ms = 0;
    std::int64_t wait_ms = timeout.count();
    if (MHD_get_timeout(daemon_, &library_ms) == MHD_YES) {
      wait_ms = std::min(wait_ms, static_cast<std::int64_t>(library_ms));
    }
    poll(&waiting, 1, static_cast<int>(wait_ms));
    MHD_run(daemon_);
    const Time now = std::chrono::steady_clock::now();
    for (Connection& connection : connections_) {
      if (now - connection.began > kMaxConnectionTime) tell_to_go(connection);
    }
  }

 private:
  struct Connection {
    MHD_Connection* library;
    int socket;
    Time began;
    bool told_to_go = false;
  };

  /// The library sees the end of the connection and closes it.
  static void tell_to_go(Connection& connection) {
    if (!std::exchange(connection.told_to_go, true)) shutdown(connection.socket, SHUT_RDWR);
  }

  static void notice(void* self, MHD_Connection* connection, void** /*ours*/,
                     MHD_ConnectionNotificationCode what) noexcept {
    auto& connections = static_cast<Library*>(self)->connections_;
    if (what == MHD_CONNECTION_NOTIFY_CLOSED) {
      connections.remove_if([&](const Connection& each) { return each.library == connection; });
      return;
    }
    const int socket = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD)->connect_fd;
    connections.push_back({connection, socket, std::chrono::steady_clock::now()});
    // Oldest first: a client that has sent its request is answered long before.
    std::size_t staying = static_cast<std::size_t>(std::count_if(
        connections.begin(), connections.end(), [](const auto& each) { return !each.told_to_go; }));
    for (auto each = connections.begin(); staying > kMaxConnections; ++each) {
      staying -= each->told_to_go ? 0 : 1;
      tell_to_go(*each);
    }
  }

  /// Called with the headers, and again when there is no more to come.
  static MHD_Result handle(void* self, MHD_Connection* connection, const char* path, const char* method,
                           const char* /*version*/, const char* /*upload*/, std::size_t* upload_bytes,
                           void** seen) noexcept {
    const bool is_refused =
        *upload_bytes > 0 || (std::string_view(method) != "GET" && std::string_view(method) != "HEAD");
    if (*seen == nullptr && !is_refused) {
      *seen = self;
      return MHD_YES;
    }
    const HttpAnswer answer = answer_to(method, path, static_cast<Library*>(self)->text_);
    MHD_Response* const response = MHD_create_response_from_buffer(
        answer.body.size(), const_cast<char*>(answer.body.data()), MHD_RESPMEM_MUST_COPY);
    MHD_add_response_header(response, "Content-Type", answer.type);
    MHD_add_response_header(response, "Connection", "close");
    const MHD_Result queued = MHD_queue_response(connection, answer.status, response);
    MHD_destroy_response(response);
    return queued;
  }

  std::function<std::string()> text_;
  std::list<Connection> connections_;  ///< oldest first
  MHD_Daemon* daemon_;
};

HttpServer::HttpServer(const std::string& where, std::function<std::string()> text)
    : library_(std::make_unique<Library>(where, std::move(text))) {}
HttpServer::~HttpServer() = default;

void HttpServer::serve(std::chrono::milliseconds timeout) { library_->serve(timeout); }

}  // namespace tubed
