#include "daemon/http/server.hpp"

#include <cerrno>
#include <chrono>
#include <utility>

#include <fcntl.h>

#include <spdlog/fmt/fmt.h>
#include <boost/asio/ip/address.hpp>

#include "daemon/http/session.hpp"

namespace posed::http {
namespace {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;
using ErrorCode = boost::system::error_code;

constexpr int kTcpSendBuffer = 128 * 1024;  // bytes that the system may keep for a slow reader
constexpr int kTcpReceiveBuffer = 64 * 1024;
constexpr std::chrono::milliseconds kPause{100};  // after a connection could not be accepted

std::string host_of(const asio::ip::address& address) {
  return fmt::format(fmt::runtime(address.is_v6() ? "[{}]" : "{}"), address.to_string());
}

std::string host_of(const asio::ip::address& address, std::uint16_t port) {
  return fmt::format("{}:{}", host_of(address), port);
}

// The names under which the server may be asked; empty: any.
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

Result<> listen(Tcp::acceptor& acceptor, const Tcp::endpoint& at, const std::string& advice) {
  ErrorCode error;
  acceptor.open(at.protocol(), error);
  // A program that posed starts must not keep the port.
  if (!error && fcntl(acceptor.native_handle(), F_SETFD, FD_CLOEXEC) != 0) {
    error.assign(errno, boost::system::system_category());
  }
  if (!error) acceptor.set_option(Tcp::acceptor::reuse_address(true), error);
  // Connections inherit these.
  if (!error) acceptor.set_option(asio::socket_base::send_buffer_size(kTcpSendBuffer), error);
  if (!error) acceptor.set_option(asio::socket_base::receive_buffer_size(kTcpReceiveBuffer), error);
  if (!error) acceptor.bind(at, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (!error) return {};
  ErrorCode ignored;
  acceptor.close(ignored);
  return fail(fmt::format("cannot listen on {}: {}; {}", host_of(at.address(), at.port()),
                          error.message(), advice));
}

}  // namespace

Result<std::unique_ptr<Server>> Server::open(asio::io_context& io, Connections& connections,
                                             const Options& options) {
  Tcp::acceptor acceptor(io);
  const asio::ip::address address = options.at.address();
  auto listens = listen(acceptor, options.at, options.advice);
  if (!listens && options.or_any) listens = listen(acceptor, {address, 0}, options.advice);
  if (!listens) return std::unexpected(listens.error());
  std::unique_ptr<Server> server(new Server(io, connections, std::move(acceptor)));
  const std::uint16_t port = server->acceptor_.local_endpoint().port();
  const auto shown = address.is_unspecified() ? asio::ip::make_address("127.0.0.1") : address;
  server->url_ = "http://" + host_of(shown, port) + "/";
  server->hosts_ = hosts_of(address, port);
  server->accept();
  return server;
}

Server::Server(asio::io_context& io, Connections& connections, Tcp::acceptor acceptor)
    : connections_(connections), acceptor_(std::move(acceptor)), pause_(io) {}

void Server::accept() {
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

// Strangers cannot keep others out by holding connections: the oldest makes room.
void Server::admit(Tcp::socket socket) {
  if (connections_.sessions.size() + connections_.service.upgraded() >= kMaxConnections) {
    if (connections_.sessions.empty()) return;
    connections_.sessions.front()->close();
  }
  ErrorCode ignored;
  socket.set_option(Tcp::no_delay(true), ignored);
  std::make_shared<Session>(std::move(socket), connections_)->read();
}

}  // namespace posed::http
