#include "clients/view/web_server.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <optional>
#include <system_error>
#include <variant>

#include "clients/view/connection.hpp"

namespace tubed {

namespace {

namespace asio = boost::asio;
using boost::system::error_code;
using Any = asio::generic::stream_protocol;

/// A listening socket of either kind; what it accepts is the same.
template <typename Protocol>
class Listener {
 public:
  Listener(asio::io_context& io, const typename Protocol::endpoint& where, Desk& desk)
      : desk_(desk), acceptor_(io, where) {}

  void accept() {
    acceptor_.async_accept(socket_.emplace(acceptor_.get_executor()), [this](error_code error) {
      if (error == asio::error::operation_aborted) return;
      if (!error) serve_connection(ViewStream(std::move(*socket_)), desk_);
      accept();
    });
  }

 private:
  Desk& desk_;
  asio::basic_socket_acceptor<Protocol> acceptor_;
  std::optional<Any::socket> socket_;
};

using TcpListener = Listener<asio::ip::tcp>;
using UnixListener = Listener<asio::local::stream_protocol>;

}  // namespace

class WebServer::Parts {
 public:
  Parts(WebServerSettings settings, std::function<void(std::string_view)> heard)
      : desk_{.access = std::move(settings.access),
              .vessel = std::move(settings.vessel),
              .vessel_path = "/vessel." + settings.files.vessel.kind,
              .heard = std::move(heard),
              .room = {},
              .tabs = {},
              .waiting = {},
              .tabs_changed = [this] { tab_count_ = desk_.tabs.size(); }} {
    listen(settings.where);
  }
  ~Parts() {
    if (!unix_path_.empty()) unlink(unix_path_.c_str());
  }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  void publish(SharedMessage message) {
    asio::post(io_, [this, message = std::move(message)] {
      if (message->kind == MessageKind::kRoom) desk_.room[message->about] = message;
      // A copy: a tab that fails goes from the list.
      for (Tab* const tab : std::vector<Tab*>(desk_.tabs)) tab->put(message);
    });
  }

  [[nodiscard]] std::size_t tabs() const { return tab_count_; }
  void run() { io_.run(); }
  void stop() { io_.stop(); }

 private:
  void listen(const ListenAddress& where) try {
    if (where.unix_path.empty()) {
      const asio::ip::tcp::endpoint endpoint(asio::ip::make_address(where.address), where.port);
      tcp_.emplace(io_, endpoint, desk_).accept();
      return;
    }
    unlink(where.unix_path.c_str());  // what a killed process left; a folder of others' cannot be written
    const mode_t before = umask(0117);
    unix_.emplace(io_, asio::local::stream_protocol::endpoint(where.unix_path), desk_).accept();
    umask(before);
    unix_path_ = where.unix_path;
  } catch (const boost::system::system_error& error) {
    throw std::system_error(
        error.code().value(), std::system_category(),
        "cannot listen on " +
            (where.unix_path.empty() ? where.address + ":" + std::to_string(where.port) : where.unix_path) +
            ", --listen chooses another address");
  }

  std::atomic<std::size_t> tab_count_{0};
  Desk desk_;
  asio::io_context io_{1};
  std::optional<TcpListener> tcp_;
  std::optional<UnixListener> unix_;
  std::string unix_path_;
};

WebServer::WebServer(WebServerSettings settings, std::function<void(std::string_view)> heard)
    : parts_(std::make_unique<Parts>(std::move(settings), std::move(heard))) {}
WebServer::~WebServer() = default;

void WebServer::publish(SharedMessage message) { parts_->publish(std::move(message)); }
std::size_t WebServer::tabs() const { return parts_->tabs(); }
void WebServer::run() { parts_->run(); }
void WebServer::stop() { parts_->stop(); }

}  // namespace tubed
