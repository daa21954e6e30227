#include <algorithm>
#include <charconv>

#include "clients/view/connection.hpp"

namespace tubed {

namespace {

namespace beast = boost::beast;
namespace websocket = boost::beast::websocket;

constexpr std::size_t kMaxHeardBytes = 1024;
// A picture is up to some 100 KB: what waits in the kernel is seconds old when a stalled tab comes back.
constexpr int kKernelQueueBytes = 1 << 16;
constexpr std::chrono::seconds kHandshakeTimeout{5};
constexpr std::chrono::seconds kIdleTimeout{10};
constexpr std::string_view kSeen = "seen ";

}  // namespace

Tab::Tab(ViewStream stream, Desk& desk) : desk_(desk), stream_(std::move(stream)) {
  desk_.tabs.push_back(this);
}

Tab::~Tab() {
  std::erase(desk_.tabs, this);
  desk_.tabs_changed();
}

void Tab::accept(const ViewRequest& request) {
  beast::get_lowest_layer(stream_).expires_never();  // the WebSocket has timeouts of its own
  boost::system::error_code ignored;
  beast::get_lowest_layer(stream_).socket().set_option(
      boost::asio::socket_base::send_buffer_size(kKernelQueueBytes), ignored);
  stream_.set_option(websocket::stream_base::timeout{kHandshakeTimeout, kIdleTimeout, true});
  stream_.read_message_max(kMaxHeardBytes);
  stream_.auto_fragment(false);  // a message is one frame
  stream_.async_accept(request, [self = shared_from_this()](Error error) {
    if (!error) self->begin();
  });
}

void Tab::begin() {
  is_open_ = true;
  desk_.tabs_changed();
  for (const auto& [about, message] : desk_.room) outbox_.put(message);
  read();
  write();
}

void Tab::put(const SharedMessage& message) {
  if (!is_open_) return;
  outbox_.put(message);
  write();
}

void Tab::close() { beast::get_lowest_layer(stream_).close(); }

void Tab::read() {
  stream_.async_read(heard_, [self = shared_from_this()](Error error, std::size_t) {
    if (error) return self->close();
    self->take();
    self->read();
  });
}

/// "seen NUMBER" acknowledges; anything else is somebody else's.
void Tab::take() {
  const std::string words = beast::buffers_to_string(heard_.data());
  heard_.consume(heard_.size());
  if (!words.starts_with(kSeen)) return desk_.heard(words);
  std::uint64_t number = 0;
  std::from_chars(words.data() + kSeen.size(), words.data() + words.size(), number);
  outbox_.acknowledge(number);
  write();
}

void Tab::write() {
  if (sending_) return;
  sending_ = outbox_.next();
  if (!sending_) return;
  stream_.binary(sending_->is_binary);
  stream_.async_write(boost::asio::buffer(sending_->payload),
                      [self = shared_from_this()](Error error, std::size_t) {
                        self->sending_.reset();
                        if (error) return self->close();
                        self->write();
                      });
}

}  // namespace tubed
