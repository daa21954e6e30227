// One connection of a browser. Included by the two files that know Boost.Beast.
#pragma once

#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "clients/view/access.hpp"
#include "clients/view/outbox.hpp"

namespace tubed {

/// An Internet or a Unix socket.
using ViewStream = boost::beast::basic_stream<boost::asio::generic::stream_protocol>;
using ViewRequest = boost::beast::http::request<boost::beast::http::empty_body>;

class Tab;

/// What connections share; of the thread that serves.
struct Desk {
  AccessRules access;
  std::string vessel;       ///< bytes; empty: there is none
  std::string vessel_path;  ///< under which it is served
  std::function<void(std::string_view)> heard;
  std::map<std::string, SharedMessage> room;  ///< what a new tab is told first
  std::vector<Tab*> tabs;
  std::vector<ViewStream*> waiting;  ///< for a request, or for its answer to be taken; oldest first
  std::function<void()> tabs_changed;
};

/// Reads requests and answers them, until one becomes a Tab. Keeps itself alive while it waits for its
/// socket.
void serve_connection(ViewStream stream, Desk& desk);

/// The stream of one tab. See WebServer. Keeps itself alive while it waits for its socket.
class Tab : public std::enable_shared_from_this<Tab> {
 public:
  Tab(ViewStream stream, Desk& desk);
  ~Tab();
  Tab(const Tab&) = delete;
  Tab& operator=(const Tab&) = delete;

  void accept(const ViewRequest& request);
  void put(const SharedMessage& message);
  void close();

 private:
  using Error = boost::beast::error_code;

  void begin();
  void read();
  void take();
  void write();

  Desk& desk_;
  boost::beast::websocket::stream<ViewStream> stream_;
  boost::beast::flat_buffer heard_;
  Outbox outbox_;
  SharedMessage sending_;  ///< null: nothing is being sent
  bool is_open_ = false;
};

}  // namespace tubed
