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
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "proto/text/number.hpp"

namespace posed::net {
namespace {

std::string last_error() { return zmq_strerror(zmq_errno()); }

constexpr std::string_view kIpc = "ipc://";

// Refuses tcp://HOST:99999: libzmq reduces the port modulo 65536 and would silently use another.
Result<> check_port(const std::string& endpoint) {
  if (!endpoint.starts_with("tcp://")) return {};
  const std::string_view text = std::string_view(endpoint).substr(endpoint.rfind(':') + 1);
  if (text == "*" || text == "!") return {};
  const bool padded_zero = text.size() > 1 && text.find_first_not_of('0') == text.npos;
  if (!padded_zero && exact_number<std::uint16_t>(text)) return {};
  return misuse("'" + endpoint + "' names a port that does not exist: give one from 1 to 65535");
}

// The file of an ipc:// endpoint; empty for another one, an abstract name (@) and one that libzmq
// chooses (*).
std::string ipc_file(std::string_view endpoint) {
  if (!endpoint.starts_with(kIpc)) return {};
  const std::string_view path = endpoint.substr(kIpc.size());
  return path == "*" || path.starts_with('@') ? std::string() : std::string(path);
}

// Whether somebody listens at this socket file.
bool is_listened_to(const std::string& file) {
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  file.copy(address.sun_path, sizeof address.sun_path - 1);
  const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return false;
  const bool answered =
      ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
      errno == EAGAIN || errno == EPROTOTYPE;  // many wait there, or it is of datagrams
  ::close(fd);
  return answered;
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

Result<> check_threads(int count) {
  std::vector<std::jthread> threads;
  std::promise<void> end;  // breaks, which ends the wait, before the threads are joined
  const auto ended = end.get_future().share();
  try {
    for (int i = 0; i < count; ++i) threads.emplace_back([ended] { ended.wait(); });
  } catch (const std::system_error& error) {
    return fail("no more threads may begin (" + std::string(error.what()) +
                "): allow more processes (ulimit -u) or memory (ulimit -v)");
  }
  return {};
}

Result<Context> open_context() {
  // libzmq ends the process where it may not begin a thread, with a line about its source code. So
  // as many are tried first, and some of posed's own, all at once.
  constexpr int kThreads = 4;
  TRY(check_threads(kThreads));
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

Result<> check_endpoint(const std::string& endpoint) {
  TRY(check_port(endpoint));
  const std::string file = ipc_file(endpoint);
  constexpr std::size_t kMaxPath = sizeof(sockaddr_un::sun_path) - 1;
  if (endpoint == kIpc || file.size() > kMaxPath) {
    return misuse("'" + endpoint + "' needs a path of 1 to " + std::to_string(kMaxPath) +
                  " letters behind ipc://");
  }
  return {};
}

Result<> check_ipc_file(const std::string& endpoint) {
  const std::string file = ipc_file(endpoint);
  struct stat found{};
  if (file.empty() || ::lstat(file.c_str(), &found) != 0 || S_ISSOCK(found.st_mode)) return {};
  return misuse("'" + endpoint + "' is something else than a socket: choose a path that is free");
}

namespace {

// libzmq uses IPv6 only where it is told to.
Result<> choose_family(void* socket, std::string_view endpoint) {
  if (!endpoint.starts_with("tcp://[")) return {};
  return set_option(socket, ZMQ_IPV6, 1);
}

std::unexpected<Error> cannot_connect(const std::string& endpoint, const std::string& why) {
  return misuse("cannot connect to '" + endpoint + "': " + why +
                "; an endpoint reads like tcp://127.0.0.1:5570");
}

}  // namespace

Result<std::string> bind_socket(void* socket, const std::string& endpoint) {
  TRY(check_endpoint(endpoint));
  TRY(check_ipc_file(endpoint));
  TRY(choose_family(socket, endpoint));
  TRY(try_descriptors());
  const auto in_use = [&] {
    return fail(endpoint +
                " is in use: another posed may be running; stop it or choose another endpoint");
  };
  // libzmq would take the socket of who listens there, and nobody could reach him any more.
  if (const auto file = ipc_file(endpoint); !file.empty() && is_listened_to(file)) return in_use();
  std::string known = endpoint;  // libzmq takes names for those of network interfaces
  constexpr std::string_view kLocalhost = "tcp://localhost:";
  if (known.starts_with(kLocalhost)) known.replace(0, kLocalhost.size(), "tcp://127.0.0.1:");
  if (zmq_bind(socket, known.c_str()) != 0) {
    if (zmq_errno() == EADDRINUSE) return in_use();
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
  TRY(check_port(endpoint));
  // libzmq connects to port 0, and over transports that no daemon has, and waits there for ever.
  const bool known = endpoint.starts_with("tcp://") || endpoint.starts_with(kIpc) ||
                     endpoint.starts_with("inproc://posed.");  // between posed's own threads
  if (!known || endpoint.ends_with(":0")) {
    return cannot_connect(endpoint, "no daemon can be there");
  }
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
  return cannot_connect(endpoint, last_error());
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
