#include "daemon/view/web_server.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <utility>
#include <vector>

#include <fcntl.h>

#include <spdlog/fmt/fmt.h>
#include <boost/asio/ip/address.hpp>

#include "daemon/view/tab_session.hpp"
#include "daemon/view/web_session.hpp"
#include "proto/text/clean.hpp"

namespace posed::view {
namespace {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;

constexpr int kTcpSendBuffer = 128 * 1024;  // bytes that the system may keep for a slow reader
constexpr int kTcpReceiveBuffer = 64 * 1024;
constexpr std::chrono::milliseconds kPause{100};  // after a connection could not be accepted

Result<asio::ip::address> address_of(const std::string& text) {
  ErrorCode error;
  auto address = asio::ip::make_address(text == "localhost" ? "127.0.0.1" : text, error);
  if (!error) return address;
  return misuse(in_quotes(text) + " is not an address: --bind takes one such as 127.0.0.1");
}

std::string host_of(const asio::ip::address& address) {
  return fmt::format(fmt::runtime(address.is_v6() ? "[{}]" : "{}"), address.to_string());
}

std::string host_of(const asio::ip::address& address, std::uint16_t port) {
  return fmt::format("{}:{}", host_of(address), port);
}

// The names under which the page may be opened; empty: any.
std::vector<std::string> hosts_of(const asio::ip::address& address, std::uint16_t port) {
  if (address.is_unspecified()) return {};
  std::vector<std::string> names{host_of(address)};
  if (address.is_loopback()) names.insert(names.end(), {"localhost", "127.0.0.1"});
  std::vector<std::string> hosts;
  for (const std::string& name : names) {
    hosts.push_back(fmt::format("{}:{}", name, port));
    if (port == 80) hosts.push_back(name);  // browsers leave HTTP's own port out
  }
  return hosts;
}

Result<> listen(Tcp::acceptor& acceptor, const asio::ip::address& address, std::uint16_t port) {
  ErrorCode error;
  const Tcp::endpoint endpoint(address, port);
  acceptor.open(endpoint.protocol(), error);
  // A browser that posed starts must not keep the port.
  if (!error && fcntl(acceptor.native_handle(), F_SETFD, FD_CLOEXEC) != 0) {
    error.assign(errno, boost::system::system_category());
  }
  if (!error) acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
  // Connections inherit these.
  if (!error) acceptor.set_option(asio::socket_base::send_buffer_size(kTcpSendBuffer), error);
  if (!error) acceptor.set_option(asio::socket_base::receive_buffer_size(kTcpReceiveBuffer), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (!error) return {};
  ErrorCode ignored;
  acceptor.close(ignored);
  return fail(fmt::format("cannot listen on {}: {}; choose another port (--port 0: any free one)",
                          host_of(address, port), error.message()));
}

}  // namespace

Result<bool> is_loopback_address(const std::string& address) {
  const auto parsed = address_of(address);
  if (!parsed) return std::unexpected(parsed.error());
  return parsed->is_loopback();
}

Result<std::unique_ptr<WebServer>> WebServer::open(asio::io_context& io, WebRoom& room,
                                                   const Options& options) {
  const auto address = address_of(options.address);
  if (!address) return std::unexpected(address.error());
  Tcp::acceptor acceptor(io);
  auto listens = listen(acceptor, *address, options.port);
  if (!listens && options.or_any) listens = listen(acceptor, *address, 0);
  if (!listens) return std::unexpected(listens.error());
  std::unique_ptr<WebServer> server(new WebServer(io, room, std::move(acceptor)));
  const std::uint16_t port = server->acceptor_.local_endpoint().port();
  const auto shown = address->is_unspecified() ? asio::ip::make_address("127.0.0.1") : *address;
  room.site.hosts = hosts_of(*address, port);
  server->port_ = port;
  server->url_ = "http://" + host_of(shown, port) + "/?token=" + room.site.token;
  server->accept();
  return server;
}

WebServer::WebServer(asio::io_context& io, WebRoom& room, Tcp::acceptor acceptor)
    : room_(room), acceptor_(std::move(acceptor)), pause_(io) {}

void WebServer::accept() {
  acceptor_.async_accept([this](const ErrorCode& error, Tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (!error) {
      admit(std::move(socket));
      return accept();
    }
    // All files are in use, for example: others have to end first.
    pause_.expires_after(kPause);
    pause_.async_wait([this](const ErrorCode& ended) {
      if (!ended) accept();
    });
  });
}

// Whoever has no token cannot keep others out: the oldest such connection makes room.
void WebServer::admit(Tcp::socket socket) {
  if (room_.sessions.size() + room_.tabs.size() >= kMaxConnections) {
    if (room_.sessions.empty()) return;
    room_.sessions.front()->close();
  }
  ErrorCode ignored;
  socket.set_option(Tcp::no_delay(true), ignored);
  std::make_shared<WebSession>(std::move(socket), room_)->read();
}

void WebServer::turn(std::int64_t now_ns) {
  for (TabSession* tab : room_.tabs) tab->check(now_ns);
}

}  // namespace posed::view
