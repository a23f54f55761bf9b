#include "daemon/net/peer_guard.hpp"

#include <algorithm>
#include <charconv>
#include <filesystem>

#include <malloc.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/socket.h>

#include "daemon/net/zap_authenticator.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/process.hpp"
#include "daemon/system/realtime.hpp"
#include "proto/frame/time.hpp"
#include "proto/zmq/tcp_peer.hpp"

namespace posed::net {
namespace {

// A flood of empty parts fills about 0.7 GB a second, so peers are checked often: 64 of them a
// tick, and all of them when the process's memory has grown.
constexpr std::int64_t kGuardTick_ns = kNanosPerSecond / 100;
constexpr std::int64_t kPeersATick = 64;
constexpr std::uint64_t kNoticeableGrowth = 4 * 1024 * 1024;  // bytes

constexpr std::size_t kMaxSubscribers = 1024;
constexpr std::size_t kMaxControllers = 64;
// kept free for devices, logs and models that are opened later
constexpr std::size_t kReservedFiles = 16;
constexpr std::size_t kMinPeers = 4;

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
  // libzmq's name for the property ZMQ_SRCFD
  const std::string_view text = message.property("__fd");
  int fd = -1;
  std::from_chars(text.data(), text.data() + text.size(), fd);
  return fd;
}

Result<std::unique_ptr<PeerGuard>> PeerGuard::open(void* context, void* socket,
                                                   const PeerLimits& limits) {
  auto events =
      TRY(SocketEvents::open(context, socket, ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_DISCONNECTED));
  auto wake = TRY(system::EventFd::open());
  auto poller = TRY(system::Poller::open());
  for (const Result<>& added : {poller->add(*wake), poller->add(events.fd(), 0)}) {
    if (!added) return std::unexpected(added.error());
  }
  return std::unique_ptr<PeerGuard>(
      new PeerGuard(std::move(events), std::move(wake), std::move(poller), limits));
}

PeerGuard::PeerGuard(SocketEvents events, std::unique_ptr<system::EventFd> wake,
                     std::unique_ptr<system::Poller> poller, const PeerLimits& limits)
    : events_(std::move(events)),
      wake_(std::move(wake)),
      poller_(std::move(poller)),
      limits_(limits),
      thread_([this] { serve(); }) {}

PeerGuard::~PeerGuard() {
  stop_.store(true);
  wake_->notify();
  thread_.join();
}

void PeerGuard::serve() {
  system::name_thread("posed-guard");
  while (!stop_.load()) {
    wake_->going_to_sleep();
    std::int64_t wait_ns = system::kForever_ns;
    {
      const std::scoped_lock lock(mutex_);
      const std::int64_t now_ns = system::monotonic_ns();
      const std::int64_t due_ns = turn(now_ns);
      if (due_ns != system::kForever_ns) wait_ns = due_ns - now_ns;
    }
    if (!stop_.load()) static_cast<void>(poller_->wait(wait_ns));
    wake_->awake();
  }
}

std::int64_t PeerGuard::turn(std::int64_t now_ns) {
  receive_events();
  if (peers_.empty()) return system::kForever_ns;
  if (is_inspection_due(now_ns)) {
    inspected_ns_ = now_ns;
    inspect_all();
  }
  return now_ns + kGuardTick_ns;
}

bool PeerGuard::is_inspection_due(std::int64_t now_ns) {
  const auto pauses = static_cast<std::int64_t>(peers_.size()) / kPeersATick;
  // Few peers are inspected at each tick; to ask for the memory would take five times as long.
  if (pauses == 0) return true;
  // Freed memory stays resident for a while, so growth alone does not show whether a peer is
  // flooding now.
  const std::uint64_t resident = system::resident_bytes();
  const bool due = resident > resident_before_ + kNoticeableGrowth ||
                   now_ns >= inspected_ns_ + kGuardTick_ns * (1 + pauses);
  if (due) resident_before_ = resident;
  return due;
}

void PeerGuard::receive_events() {
  while (const auto event = events_.next()) {
    const int fd = event->value;
    if (peers_.erase(fd) > 0) gone_.push_back(fd);
    if (event->number == ZMQ_EVENT_ACCEPTED) admit(fd);
  }
}

void PeerGuard::admit(int fd) {
  peers_[fd].cookie = cookie_of(fd);
  if (peers_.size() > limits_.max_peers) cut_now(fd, "came when there were too many");
}

void PeerGuard::inspect_all() {
  std::uint64_t unfinished = 0;
  std::uint64_t most = 0;
  int most_fd = -1;
  for (const auto& [fd, peer] : peers_) {
    const std::uint64_t bytes = received_bytes(fd);
    const std::uint64_t since = bytes - std::min(bytes, peer.received);
    if (peer.is_cut) continue;
    unfinished += since;
    if (since > most) {
      most = since;
      most_fd = fd;
    }
  }
  if (most <= limits_.max_unfinished && unfinished <= limits_.max_unfinished_of_all) return;
  cut_offender(most_fd, "sent much and ended no message");
  malloc_trim(0);
  resident_before_ = 0;  // others may be flooding, too: check all again at the next tick
}

bool PeerGuard::knows(int fd) {
  const std::scoped_lock lock(mutex_);
  if (fd < 0 || peers_.contains(fd)) return fd >= 0;
  receive_events();  // its connection event may still be waiting
  wake_->notify();
  return peers_.contains(fd);
}

void PeerGuard::received(int fd, std::string_view user) {
  const std::scoped_lock lock(mutex_);
  const auto found = peers_.find(fd);
  if (found == peers_.end()) return;
  Peer& peer = found->second;
  peer.received = received_bytes(fd);
  if (!peer.spoke) peer.user = user;
  peer.spoke = true;
}

std::vector<int> PeerGuard::drain_ended() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(gone_, {});
}

std::size_t PeerGuard::peers() const {
  const std::scoped_lock lock(mutex_);
  return peers_.size();
}

std::uint64_t PeerGuard::cuts() const {
  const std::scoped_lock lock(mutex_);
  return cuts_;
}

void PeerGuard::cut(int fd, const char* why) {
  const std::scoped_lock lock(mutex_);
  cut_offender(fd, why);
}

void PeerGuard::cut_offender(int fd, const char* why) {
  cut_now(fd, why);
  if (limits_.authenticator != nullptr) limits_.authenticator->slow_down();
}

void PeerGuard::cut_now(int fd, const char* why) {
  const auto found = peers_.find(fd);
  if (found == peers_.end() || found->second.is_cut) return;
  found->second.is_cut = true;
  // libzmq's thread may have closed the connection since then, and its descriptor may have been
  // reused.
  if (found->second.cookie == 0 || cookie_of(fd) != found->second.cookie) return;
  shutdown(fd, SHUT_RDWR);
  ++cuts_;
  spdlog::warn("a connection to the {} socket was cut: it {}", limits_.name, why);
}

void PeerGuard::cut_unless(const std::function<bool(std::string_view user)>& allowed) {
  const std::scoped_lock lock(mutex_);
  receive_events();
  for (const auto& [fd, peer] : peers_) {
    if (!peer.spoke || !allowed(peer.user)) {
      cut_now(fd, "has lost its right, or has not identified itself");
    }
  }
}

PeerShares peer_shares() {
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  std::error_code none;
  std::size_t open = 0;
  for (std::filesystem::directory_iterator file("/proc/self/fd", none), end; !none && file != end;
       file.increment(none)) {
    ++open;
  }
  const std::size_t used = open + kReservedFiles;
  const std::size_t files = limit.rlim_cur;
  const std::size_t free = files > used ? files - used : 0;
  return {.publish = std::clamp(free * 3 / 4, kMinPeers, kMaxSubscribers),
          .control = std::clamp(free / 4, kMinPeers, kMaxControllers)};
}

void raise_file_limit() noexcept {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0 || limit.rlim_cur == limit.rlim_max) return;
  limit.rlim_cur = limit.rlim_max;
  setrlimit(RLIMIT_NOFILE, &limit);
}

}  // namespace posed::net
