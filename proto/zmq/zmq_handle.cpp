#include "proto/zmq/zmq_handle.hpp"

#include <array>
#include <cerrno>
#include <cstdint>
#include <future>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <sys/eventfd.h>
#include <unistd.h>

#include "proto/text/number.hpp"

namespace posed::net {
namespace {

std::string last_error() { return zmq_strerror(zmq_errno()); }

std::string no_such_port(const std::string& endpoint) {
  return "'" + endpoint + "' names a port that does not exist: give one from 1 to 65535";
}

// libzmq ends the process where it may not begin a thread, with a line about its source code. So as
// many are tried first, and some of posed's own, all at once.
Result<> try_threads() {
  constexpr int kThreads = 4;
  std::vector<std::jthread> threads;
  std::promise<void> end;  // breaks, which ends the wait, before the threads are joined
  const auto ended = end.get_future().share();
  try {
    for (int i = 0; i < kThreads; ++i) threads.emplace_back([ended] { ended.wait(); });
  } catch (const std::system_error& error) {
    return fail("no more threads may begin (" + std::string(error.what()) +
                "): allow more processes (ulimit -u) or memory (ulimit -v)");
  }
  return {};
}

// libzmq also ends the process where it may open no more descriptors. A context with a socket needs
// six, and to look up an address takes one.
Result<> try_descriptors() {
  std::array<int, 8> tried{};
  tried.fill(-1);
  for (int& fd : tried) fd = ::eventfd(0, EFD_CLOEXEC);
  const bool enough = tried.back() >= 0;
  for (const int fd : tried) {
    if (fd >= 0) ::close(fd);
  }
  if (enough) return {};
  return fail("posed may open no more files; raise their limit (ulimit -n, LimitNOFILE)");
}

}  // namespace

Result<Context> open_context() {
  TRY(try_threads());
  Context context(zmq_ctx_new());
  if (!context) return fail("ZeroMQ does not start: " + last_error());
  return context;
}

Result<Socket> open_socket(void* context, int type) {
  TRY(try_descriptors());
  Socket socket(zmq_socket(context, type));
  if (!socket) return fail("ZeroMQ cannot open a socket: " + last_error());
  TRY(set_option(socket.get(), ZMQ_LINGER, 0));
  return socket;
}

Result<> set_option(void* socket, int option, int value) {
  if (zmq_setsockopt(socket, option, &value, sizeof value) == 0) return {};
  return fail("ZeroMQ refuses socket option " + std::to_string(option) + ": " + last_error());
}

Result<> set_option(void* socket, int option, std::string_view value) {
  if (zmq_setsockopt(socket, option, value.data(), value.size()) == 0) return {};
  return fail("ZeroMQ refuses socket option " + std::to_string(option) + ": " + last_error());
}

bool has_possible_port(std::string_view endpoint) noexcept {
  if (!endpoint.starts_with("tcp://")) return true;
  const std::string_view text = endpoint.substr(endpoint.rfind(':') + 1);
  if (text == "*" || text == "!") return true;
  return exact_number<std::uint16_t>(text).has_value();
}

namespace {

// libzmq uses IPv6 only where it is told to.
Result<> choose_family(void* socket, std::string_view endpoint) {
  if (!endpoint.starts_with("tcp://[")) return {};
  return set_option(socket, ZMQ_IPV6, 1);
}

}  // namespace

Result<std::string> bind_socket(void* socket, const std::string& endpoint) {
  if (!has_possible_port(endpoint)) return misuse(no_such_port(endpoint));
  TRY(choose_family(socket, endpoint));
  TRY(try_descriptors());
  if (zmq_bind(socket, endpoint.c_str()) != 0) {
    if (zmq_errno() == EADDRINUSE) {
      return fail(endpoint +
                  " is in use: another posed may be running; stop it or choose another"
                  " endpoint");
    }
    if (zmq_errno() == EADDRNOTAVAIL) {
      return fail("cannot listen on '" + endpoint +
                  "': this machine has no such address; give one that `ip address` lists");
    }
    return fail("cannot listen on '" + endpoint + "': " + last_error() +
                "; an endpoint reads like tcp://127.0.0.1:5570");
  }
  std::array<char, 512> bound{};
  std::size_t size = bound.size();
  if (zmq_getsockopt(socket, ZMQ_LAST_ENDPOINT, bound.data(), &size) != 0) return endpoint;
  return std::string(bound.data());
}

Result<> connect_socket(void* socket, const std::string& endpoint) {
  if (!has_possible_port(endpoint)) return misuse(no_such_port(endpoint));
  TRY(choose_family(socket, endpoint));
  TRY(try_descriptors());
  // A daemon that loses its power or its network says nothing: TCP finds that out in five seconds.
  for (const auto& [option, value] : {std::pair{ZMQ_TCP_KEEPALIVE, 1},
                                      {ZMQ_TCP_KEEPALIVE_IDLE, 2},
                                      {ZMQ_TCP_KEEPALIVE_INTVL, 1},
                                      {ZMQ_TCP_KEEPALIVE_CNT, 3}}) {
    TRY(set_option(socket, option, value));
  }
  if (zmq_connect(socket, endpoint.c_str()) == 0) return {};
  return misuse("cannot connect to '" + endpoint + "': " + last_error() +
                "; an endpoint reads like tcp://127.0.0.1:5570");
}

// Reading ZMQ_EVENTS makes libzmq process pending commands from its I/O thread.
void update_peers(void* socket) noexcept {
  int events = 0;
  std::size_t size = sizeof events;
  (void)zmq_getsockopt(socket, ZMQ_EVENTS, &events, &size);
}

bool send_part(void* socket, std::string_view bytes, bool more) noexcept {
  const int flags = ZMQ_DONTWAIT | (more ? ZMQ_SNDMORE : 0);
  return zmq_send(socket, bytes.data(), bytes.size(), flags) >= 0;
}

}  // namespace posed::net
