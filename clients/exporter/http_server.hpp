// As much of HTTP as a scrape of metrics needs, by libmicrohttpd: one small answer to each GET, then the
// connection is closed.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace tubed {

struct HttpAnswer {
  unsigned status = 0;
  const char* type = "text/plain";
  std::string body;
};

/// 200 with `text()` for GET /metrics, a page that links there for GET /, 404 for other paths, 405 for other
/// methods.
HttpAnswer answer_to(std::string_view method, std::string_view path,
                     const std::function<std::string()>& text);

/// Listens on one address. All clients are served at the same time by one thread, that of serve(): a slow
/// client delays no other. A connection lives for 2 s at most, whatever its client does; there are 64 at
/// most, of which the oldest makes room for a new one; a request may have 8 KB.
class HttpServer {
 public:
  /// `where`: ADDRESS:PORT, an IPv4 address; `text`: what /metrics shows. Throws std::invalid_argument when
  /// it is none, std::system_error when it cannot be listened on.
  HttpServer(const std::string& where, std::function<std::string()> text);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Takes in and answers what has come, waiting so long for the first of it.
  void serve(std::chrono::milliseconds timeout);

 private:
  class Library;
  std::unique_ptr<Library> library_;
};

}  // namespace tubed
