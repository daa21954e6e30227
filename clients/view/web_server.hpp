// The page and its stream over HTTP and WebSocket, by Boost.Beast: one thread serves all tabs.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "clients/view/access.hpp"
#include "clients/view/listen_address.hpp"
#include "clients/view/outbox.hpp"
#include "clients/view/room_files.hpp"

namespace tubed {

struct WebServerSettings {
  ListenAddress where;
  AccessRules access;
  std::string vessel;  ///< bytes of files.vessel, served as /vessel.stl or /vessel.vtp; empty: none
  RoomFiles files;     ///< what pages are told of it and of points; see RoomKnowledge
};

/// Serves the page's files, the vessel, and at /stream a WebSocket that carries the newest messages (see
/// Outbox). A request's head has 8 KB at most and 5 s, a message of a page 1 KB; there are kMaxTabs streams
/// at most. Of more than 64 connections that have no stream the oldest makes room. A tab that takes nothing
/// for 10 s and does not answer a ping is closed.
class WebServer {
 public:
  static constexpr std::size_t kMaxTabs = 32;

  /// `heard`: words of a page that are no acknowledgement, as {"press": NAME}; called by the thread of run().
  /// Throws std::system_error when it cannot listen there.
  WebServer(WebServerSettings settings, std::function<void(std::string_view)> heard);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// Any thread. Messages of the kind kRoom are also what a tab gets that comes later.
  void publish(SharedMessage message);
  /// Any thread: how many streams there are. Nobody encodes images for nobody.
  [[nodiscard]] std::size_t tabs() const;

  /// Serves until stop().
  void run();
  /// Any thread.
  void stop();

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace tubed
