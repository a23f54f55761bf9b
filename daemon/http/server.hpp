// Server: a small HTTP server on top of Boost.Beast. It accepts connections and asks a service what
// to answer. Every connection has limits of its own in bytes and time, and there is a limit for all
// together, so strangers can neither fill the memory nor keep the server's users out for good. One
// thread: the one that runs the io_context. Cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "daemon/http/service.hpp"
#include "proto/frame/result.hpp"

namespace posed::http {

inline constexpr std::size_t kMaxConnections = 64;  // one more closes the oldest

class Server {
 public:
  // Where to listen.
  struct Options {
    boost::asio::ip::tcp::endpoint at{};  // port 0: the system chooses one
    bool or_any = false;                  // if the port is in use, the system chooses another one
    std::string advice{};                 // the end of the error: what to do if no port is free
  };
  // `io` and `connections` outlive the server.
  static Result<std::unique_ptr<Server>> open(boost::asio::io_context& io, Connections& connections,
                                              const Options& options);

  // "http://127.0.0.1:5580/". A server that listens on all addresses gives the loopback address.
  [[nodiscard]] const std::string& url() const noexcept { return url_; }
  // The Host headers of the server's own addresses, for is_own_host(); empty: all, because it
  // listens on all addresses.
  [[nodiscard]] const std::vector<std::string>& hosts() const noexcept { return hosts_; }

 private:
  Server(boost::asio::io_context& io, Connections& connections,
         boost::asio::ip::tcp::acceptor acceptor);
  void accept();
  void admit(boost::asio::ip::tcp::socket socket);

  Connections& connections_;
  boost::asio::ip::tcp::acceptor acceptor_;
  boost::asio::steady_timer pause_;
  std::string url_;
  std::vector<std::string> hosts_;
};

}  // namespace posed::http
