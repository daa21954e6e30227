#include "clients/view/connection.hpp"

#include <chrono>
#include <optional>
#include <utility>

#include "clients/view/page_files.hpp"
#include "clients/view/web_server.hpp"

namespace tubed {

namespace {

namespace beast = boost::beast;
namespace http = boost::beast::http;

constexpr std::size_t kMaxWaiting = 64;
constexpr std::uint32_t kMaxHeadBytes = 8192;
constexpr std::chrono::seconds kRequestTimeout{5};
constexpr std::string_view kStream = "/stream";
// Nothing of another origin, no script or style within the document, in no frame.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

using Answer = http::response<http::string_body>;

std::string_view text_of(boost::beast::string_view words) { return {words.data(), words.size()}; }

RequestHead head_of(const ViewRequest& request) {
  return {.method = text_of(request.method_string()),
          .target = text_of(request.target()),
          .host = text_of(request[http::field::host]),
          .origin = text_of(request[http::field::origin]),
          .cookie = text_of(request[http::field::cookie]),
          .fetch_site = text_of(request["Sec-Fetch-Site"]),
          .fetch_mode = text_of(request["Sec-Fetch-Mode"]),
          .is_upgrade = beast::websocket::is_upgrade(request),
          .has_body =
              request.has_content_length() ? request[http::field::content_length] != "0" : request.chunked()};
}

void add_headers(Answer& answer) {
  answer.set("Content-Security-Policy", kPolicy);
  answer.set("X-Content-Type-Options", "nosniff");
  answer.set("Referrer-Policy", "no-referrer");
  answer.set("Cross-Origin-Resource-Policy", "same-origin");
  answer.set("Cross-Origin-Opener-Policy", "same-origin");
  answer.set("Permissions-Policy", "camera=(), microphone=(), geolocation=()");
  answer.set(http::field::cache_control, "no-store");
}

Answer answer_with(unsigned status, std::string_view type, std::string_view body) {
  Answer answer{http::int_to_status(status), 11};
  answer.set(http::field::content_type, boost::beast::string_view(type.data(), type.size()));
  add_headers(answer);
  answer.body().assign(body);
  answer.prepare_payload();
  return answer;
}

/// What a request that is no upgrade is answered.
Answer answer_to(const RequestHead& head, const Desk& desk) {
  const AccessVerdict verdict = judge(head, desk.access);
  if (verdict.status != 200) {
    Answer answer = answer_with(verdict.status, "text/plain; charset=utf-8", verdict.words);
    if (verdict.status == 303) {
      answer.set(http::field::location, "/");
      answer.set(http::field::set_cookie,
                 "tubed_view=" + desk.access.token + "; HttpOnly; SameSite=Strict; Path=/");
    }
    return answer;
  }
  const std::string_view path = path_of(head.target);
  if (path == desk.vessel_path && !desk.vessel.empty()) {
    return answer_with(200, "application/octet-stream", desk.vessel);
  }
  const PageFile* const file = find_page_file(path);
  return file == nullptr ? answer_with(404, "text/plain; charset=utf-8", "there is /\n")
                         : answer_with(200, file->type, file->body);
}

/// Requests on one connection, one after the other.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(ViewStream stream, Desk& desk) : desk_(desk), stream_(std::move(stream)) {
    desk_.waiting.push_back(&stream_);
  }
  ~Connection() { std::erase(desk_.waiting, &stream_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void read() {
    parser_.emplace();
    parser_->header_limit(kMaxHeadBytes);
    stream_.expires_after(kRequestTimeout);
    http::async_read_header(
        stream_, buffer_, *parser_,
        [self = shared_from_this()](beast::error_code error, std::size_t) { self->take(error); });
  }

 private:
  void take(beast::error_code error) {
    if (error == http::error::header_limit) {
      return answer(answer_with(431, "text/plain", "a request's head has 8 KB at most\n"), true);
    }
    const bool is_of_http = error.category() == http::make_error_code(http::error::bad_method).category();
    if (error == http::error::end_of_stream || (error && !is_of_http)) return;  // gone, or too slow
    if (error) return answer(answer_with(400, "text/plain", "no HTTP request\n"), true);
    const RequestHead head = head_of(parser_->get());
    const bool is_stream = head.is_upgrade && path_of(head.target) == kStream;
    if (!is_stream || judge(head, desk_.access).status != 200) {
      Answer answered = answer_to(head, desk_);
      if (head.method == "HEAD") answered.body().clear();  // its length stays
      return answer(std::move(answered), head.has_body || head.is_upgrade);
    }
    if (desk_.tabs.size() >= WebServer::kMaxTabs) {
      return answer(answer_with(503, "text/plain", "too many tabs are open\n"), true);
    }
    std::make_shared<Tab>(std::move(stream_), desk_)->accept(parser_->get());
  }

  void answer(Answer answer, bool is_last) {
    answer_ = std::move(answer);
    answer_.keep_alive(!is_last && parser_->get().keep_alive());
    stream_.expires_after(kRequestTimeout);
    http::async_write(stream_, answer_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (!error && self->answer_.keep_alive()) self->read();
    });
  }

  Desk& desk_;
  ViewStream stream_;
  beast::flat_buffer buffer_{kMaxHeadBytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
  Answer answer_;
};

}  // namespace

// Who dawdles longest makes room: one that has sent its request is answered long before.
void serve_connection(ViewStream stream, Desk& desk) {
  if (desk.waiting.size() >= kMaxWaiting) desk.waiting.front()->close();
  std::make_shared<Connection>(std::move(stream), desk)->read();
}

}  // namespace tubed
