// WebServer: HTTP and WebSocket for the pages, by Boost.Beast. It accepts connections, asks the
// rules (request_rules) what to answer, and makes a tab of the Hub out of each WebSocket. Every
// connection has limits of its own in bytes and time, and there is a limit for all together, so
// strangers can neither fill the memory nor keep the page's owner out. One thread: the one that
// runs the io_context. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "daemon/view/hub.hpp"
#include "daemon/view/request_rules.hpp"
#include "proto/frame/result.hpp"

namespace posed::view {

inline constexpr std::size_t kMaxConnections =
    64;                                      // at once; one more ends the oldest without a tab
inline constexpr std::size_t kMaxTabs = 32;  // of them

class WebSession;
class TabSession;

// What all connections share; outlives them and the io_context.
struct WebRoom {
  Site site{};
  Hub& hub;
  std::list<WebSession*> sessions{};  // that are no tab, the oldest first
  std::list<TabSession*> tabs{};
};

class WebServer {
 public:
  // Where to listen. `port` 0: any free one; with `or_any`, also if that port is in use.
  struct Options {
    std::string address = "127.0.0.1";
    std::uint16_t port = 0;
    bool or_any = false;
  };
  // Listens, and sets the hosts of the room's site. `io` and `room` outlive the server.
  [[nodiscard]] static Result<std::unique_ptr<WebServer>> open(boost::asio::io_context& io,
                                                               WebRoom& room,
                                                               const Options& options);

  [[nodiscard]] std::uint16_t port() const noexcept { return port_; }
  // The page's address with the token. Where the bridge listens on all addresses, that of this
  // machine for itself.
  [[nodiscard]] const std::string& url() const noexcept { return url_; }
  // Ends tabs that have taken nothing for too long. Call some times a second.
  void turn(std::int64_t now_ns);

 private:
  WebServer(boost::asio::io_context& io, WebRoom& room, boost::asio::ip::tcp::acceptor acceptor);
  void accept();
  void admit(boost::asio::ip::tcp::socket socket);

  WebRoom& room_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer pause_;
  std::uint16_t port_ = 0;
  std::string url_;
};

// Whether an address is this machine's own, which no other machine reaches.
[[nodiscard]] Result<bool> is_loopback_address(const std::string& address);

}  // namespace posed::view
