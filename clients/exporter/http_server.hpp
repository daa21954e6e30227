// As much of HTTP as a scrape of metrics needs: one small answer to each GET, then the connection is closed.
#pragma once

#include <chrono>
#include <functional>
#include <string>

namespace tubed {

/// The answer to a request's first line: 200 with `text()` for GET /metrics, a page that links there for GET
/// /, 404 for other paths, 405 for other methods, 400 for what is no request.
std::string answer_to(const std::string& request, const std::function<std::string()>& text);

/// Listens on one address. One thread.
class HttpServer {
 public:
  /// `where`: ADDRESS:PORT, an IPv4 address. Throws std::invalid_argument when it is none, std::system_error
  /// when it cannot be listened on.
  explicit HttpServer(const std::string& where);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Answers at most one connection, waiting so long for it. A client that says or takes nothing is given up
  /// after a second.
  void serve(std::chrono::milliseconds patience, const std::function<std::string()>& text) const;

 private:
  int socket_ = -1;
};

}  // namespace tubed
