// Bridge: what `posed view` runs, with the HTTP service and the WebSockets of its pages. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <list>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "daemon/http/exchange.hpp"
#include "daemon/http/service.hpp"
#include "daemon/tools/view/daemon_link.hpp"
#include "daemon/tools/view/hub.hpp"
#include "daemon/tools/view/request_rules.hpp"
#include "proto/frame/result.hpp"

namespace posed::view {

// WebRoom: what `posed view` serves over HTTP: the page by its rules (request_rules), and a tab of
// the Hub for each WebSocket. One thread: the one that runs the io_context.
inline constexpr std::size_t kMaxTabs = 32;  // of http::kMaxConnections

class TabSession;

class WebRoom final : public http::Service {
 public:
  // `of_hub` outlives the room; the room outlives the connections and the io_context.
  WebRoom(Site of_site, Hub& of_hub) : site(std::move(of_site)), hub(of_hub) {}

  [[nodiscard]] http::Answer answer(const http::Request& request) override;
  [[nodiscard]] std::vector<http::Header> headers(std::string_view host) const override {
    return safety_headers(host, site.files.has_camera());
  }
  void upgrade(boost::beast::tcp_stream stream, const http::Message& request) override;
  [[nodiscard]] std::size_t upgraded() const override { return tabs.size(); }
  // Ends tabs that have taken nothing for too long. Call some times a second.
  void turn(std::int64_t now_ns);

  Site site;
  Hub& hub;
  std::list<TabSession*> tabs{};
};

// TabSession: the WebSocket of one open page. It sends what the tab's outbox gives, one message at
// a time, and reads the page's messages while their answers have room. It keeps itself alive until
// the connection has ended.
class TabSession : public std::enable_shared_from_this<TabSession> {
 public:
  // The connection of a request that the rules let become a WebSocket. `room` outlives it.
  TabSession(boost::beast::tcp_stream stream, WebRoom& room);
  ~TabSession();
  TabSession(const TabSession&) = delete;
  TabSession& operator=(const TabSession&) = delete;

  void start(const http::Message& request);
  // Ends the connection if the page has taken nothing for too long.
  void check(std::int64_t now_ns);

 private:
  void read();
  void send();
  void close();

  WebRoom& room_;
  std::list<TabSession*>::iterator place_;
  boost::beast::websocket::stream<boost::beast::tcp_stream> socket_;
  boost::beast::flat_buffer buffer_;
  Tab tab_;
  Parcel sending_;               // its bytes stay until they are sent
  std::int64_t sending_ns_ = 0;  // since when
  bool open_ = false, reading_ = false, is_sending_ = false;
};

inline constexpr std::uint16_t kUsualPort = 5580;

struct BridgeOptions {
  LinkOptions link{};
  std::filesystem::path page{};       // the folder with index.html
  std::string address = "127.0.0.1";  // where the page is served
  std::uint16_t port = kUsualPort;    // 0: any free one
  bool or_any_port = false;           // if the port is in use, any free one
  std::string token{};                // empty: a new one
};

// Whether an address is this machine's own, which no other machine reaches.
Result<bool> is_loopback_address(const std::string& address);

// Bridge: what `posed view` runs. A thread of its own serves the page over HTTP, passes on what a
// daemon publishes to every open page at that page's pace, and the pages' requests to the daemon.
// For the daemon it is one client like any other.
class Bridge {
 public:
  // Reads the page, listens and connects in the background.
  static Result<std::unique_ptr<Bridge>> start(const BridgeOptions& options);
  // Ends the thread; open pages see their connection end.
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  // The page's address with the token that opens it. Any thread.
  [[nodiscard]] const std::string& url() const noexcept;

 private:
  class Parts;
  explicit Bridge(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace posed::view
