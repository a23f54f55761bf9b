#include "daemon/control/peer_guard.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>

#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include "daemon/control/received_bytes.hpp"
#include "daemon/publish/process.hpp"
#include "proto/frame/time.hpp"

namespace posed::control {
namespace {

constexpr std::int64_t kNoTurn_ns = std::numeric_limits<std::int64_t>::max();
// A flood of empty parts fills about 0.7 GB a second. Looking at the process' memory is one small
// read; the peers are looked at when it has grown, and now and then in any case.
constexpr std::int64_t kGuardTick_ns = kNanosPerSecond / 100;
constexpr std::int64_t kInspectEvery_ns = kNanosPerSecond / 5;
constexpr std::uint64_t kNoticeableGrowth = 4 * 1024 * 1024;  // bytes

constexpr std::size_t kMostSubscribers = 1024;
constexpr std::size_t kMostControllers = 64;
constexpr std::size_t kReservedFiles = 16;  // for devices, logs and models that come later
constexpr std::size_t kFewestPeers = 4;

std::uint64_t cookie_of(int fd) {
  std::uint64_t cookie = 0;
  socklen_t size = sizeof cookie;
  return getsockopt(fd, SOL_SOCKET, SO_COOKIE, &cookie, &size) == 0 ? cookie : 0;
}

}  // namespace

Result<> set_receive_limits(void* socket, std::int64_t part_bytes, int messages, int buffer_bytes) {
  const std::string_view largest(reinterpret_cast<const char*>(&part_bytes), sizeof part_bytes);
  for (const Result<>& set :
       {set_option(socket, ZMQ_MAXMSGSIZE, largest), set_option(socket, ZMQ_RCVHWM, messages),
        set_option(socket, ZMQ_RCVBUF, buffer_bytes)}) {
    if (!set) return set;
  }
  return {};
}

int source_of(const Message& message) {
  const std::string_view text = message.property("__fd");  // libzmq's name for ZMQ_SRCFD
  int fd = -1;
  std::from_chars(text.data(), text.data() + text.size(), fd);
  return fd;
}

Result<std::unique_ptr<PeerGuard>> PeerGuard::open(void* context, void* socket,
                                                   const PeerLimits& limits) {
  const std::string endpoint = std::string("inproc://posed.peers.") + limits.name;
  if (zmq_socket_monitor(socket, endpoint.c_str(), ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_DISCONNECTED) !=
      0) {
    return fail(std::string("cannot watch connections: ") + zmq_strerror(zmq_errno()));
  }
  auto monitor = open_socket(context, ZMQ_PAIR);
  if (!monitor) return std::unexpected(monitor.error());
  // Without a limit: libzmq's own thread would wait here for us to read.
  if (auto set = set_option(monitor->get(), ZMQ_RCVHWM, 0); !set) {
    return std::unexpected(set.error());
  }
  if (auto done = connect_socket(monitor->get(), endpoint); !done) {
    return std::unexpected(done.error());
  }
  int fd = -1;
  std::size_t size = sizeof fd;
  if (zmq_getsockopt(monitor->get(), ZMQ_FD, &fd, &size) != 0) {
    return fail("ZeroMQ names no descriptor to wait for");
  }
  return std::unique_ptr<PeerGuard>(new PeerGuard(socket, std::move(*monitor), fd, limits));
}

PeerGuard::PeerGuard(void* socket, Socket monitor, int monitor_fd, const PeerLimits& limits)
    : socket_(socket),
      monitor_(std::move(monitor)),
      monitor_fd_(monitor_fd),
      limits_(limits),
      told_ns_(std::numeric_limits<std::int64_t>::min() / 2) {}

PeerGuard::~PeerGuard() { zmq_socket_monitor(socket_, nullptr, 0); }

std::int64_t PeerGuard::turn(std::int64_t now_ns) {
  if (now_ns < due_ns_) return due_ns_;
  now_ns_ = now_ns;
  hear_monitor();
  due_ns_ = peers_.empty() ? kNoTurn_ns : now_ns + kGuardTick_ns;
  if (peers_.empty()) return due_ns_;
  if (const std::uint64_t resident = publish::resident_bytes();
      resident > resident_before_ + kNoticeableGrowth ||
      now_ns >= inspected_ns_ + kInspectEvery_ns) {
    resident_before_ = resident;
    inspected_ns_ = now_ns;
    inspect_all();
  }
  return due_ns_;
}

// An event is two parts: number (16 bits) and descriptor (32), then the endpoint.
void PeerGuard::hear_monitor() {
  Message part;
  while (part.receive(monitor_.get())) {
    std::uint16_t event = 0;
    std::int32_t fd = -1;
    const std::string_view text = part.text();
    if (text.size() == sizeof event + sizeof fd) {
      std::memcpy(&event, text.data(), sizeof event);
      std::memcpy(&fd, text.data() + sizeof event, sizeof fd);
    }
    while (part.more() && part.receive(monitor_.get(), 0)) {
    }
    if (event != ZMQ_EVENT_ACCEPTED && event != ZMQ_EVENT_DISCONNECTED) continue;
    if (peers_.erase(fd) > 0) gone(fd);
    if (event == ZMQ_EVENT_ACCEPTED) admit(fd);
  }
}

void PeerGuard::admit(int fd) {
  peers_[fd].cookie = cookie_of(fd);
  if (peers_.size() > limits_.most_peers) cut(fd, "came when there were too many");
}

void PeerGuard::inspect_all() {
  std::uint64_t unheard = 0;
  std::uint64_t most = 0;
  int most_fd = -1;
  for (const auto& [fd, peer] : peers_) {
    const std::uint64_t bytes = received_bytes(fd);
    const std::uint64_t since = bytes - std::min(bytes, peer.heard);
    if (peer.is_cut) continue;
    unheard += since;
    if (since > most) {
      most = since;
      most_fd = fd;
    }
  }
  if (unheard <= limits_.most_unheard) return;
  cut(most_fd, "sent much and ended no message");
  inspected_ns_ = now_ns_ - kInspectEvery_ns;  // it may not have been the only one
}

bool PeerGuard::knows(int fd) {
  if (fd >= 0 && !peers_.contains(fd)) hear_monitor();  // it may have come since the last turn
  return peers_.contains(fd);
}

void PeerGuard::heard(int fd, std::string_view user) {
  const auto found = peers_.find(fd);
  if (found == peers_.end()) return;
  Peer& peer = found->second;
  peer.heard = received_bytes(fd);
  if (!peer.spoke) peer.user = user;
  peer.spoke = true;
}

void PeerGuard::cut(int fd, const char* why) {
  const auto found = peers_.find(fd);
  if (found == peers_.end() || found->second.is_cut) return;
  found->second.is_cut = true;
  // libzmq's thread may have closed the connection and the number may name another thing by now.
  if (found->second.cookie == 0 || cookie_of(fd) != found->second.cookie) return;
  shutdown(fd, SHUT_RDWR);
  tell(why);
}

void PeerGuard::cut_unless(const std::function<bool(std::string_view user)>& allowed) {
  hear_monitor();
  for (const auto& [fd, peer] : peers_) {
    if (!peer.spoke || !allowed(peer.user)) cut(fd, "has lost its right, or did not say its name");
  }
}

void PeerGuard::tell(const char* why) {
  ++cuts_;
  ++untold_;
  if (now_ns_ < told_ns_ + kNanosPerSecond) return;  // a flood is one line a second
  told_ns_ = now_ns_;
  if (untold_ == 1) {
    spdlog::warn("a connection to the {} socket was cut: it {}", limits_.name, why);
  } else {
    spdlog::warn("{} connections to the {} socket were cut; the last {}", untold_, limits_.name,
                 why);
  }
  untold_ = 0;
}

PeerShares peer_shares() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  std::error_code none;
  const auto open = static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator("/proc/self/fd", none), {}));
  const std::size_t used = open + kReservedFiles;
  const auto files = static_cast<std::size_t>(limit.rlim_cur);
  const std::size_t free = files > used ? files - used : 0;
  return {.publish = std::clamp(free * 3 / 4, kFewestPeers, kMostSubscribers),
          .control = std::clamp(free / 4, kFewestPeers, kMostControllers)};
}

void raise_file_limit() noexcept {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == limit.rlim_max) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace posed::control
