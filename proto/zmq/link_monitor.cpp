#include "proto/zmq/link_monitor.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <mutex>
#include <utility>
#include <vector>

#include <malloc.h>
#include <poll.h>
#include <pthread.h>
#include <sys/socket.h>

#include "proto/zmq/tcp_peer.hpp"

namespace posed::net {
namespace {

// A secured daemon may close the connection to a client without a key before the client has read
// the ZMTP greeting, and whoever has a socket of another kind closes it as well; libzmq then
// reports no reason. So the client concludes that it was refused only after it was closed on this
// many times in a row; a daemon that is merely ending is not there for a second try.
constexpr int kHangUps = 3;

constexpr int kEvents = ZMQ_EVENT_CONNECTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED |
                        ZMQ_EVENT_HANDSHAKE_FAILED_AUTH | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                        ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_DISCONNECTED;

// What a connection may have brought since it was looked at last: counted when it ends, so that
// many short ones bring no more than a long one while nothing is received.
constexpr std::uint64_t kUnseen = 384 * 1024;

// The bytes that wait in each link. When they are too many in all, the link with the most is cut:
// whatever the number of links is, those with less keep theirs.
std::mutex unreceived_mutex;
std::vector<const std::uint64_t*> unreceived_of_links;

constexpr int kTick_ms = 10;  // a flood of empty parts fills about 0.7 GB a second

// Bytes that a part took on the wire (ZMTP 3): the header of its frame, and of CURVE's box.
std::uint64_t wire_bytes(std::size_t part, bool with_key) {
  constexpr std::uint64_t kBox = 33, kShortFrame = 255, kShortHeader = 2, kLongHeader = 9;
  const std::uint64_t frame = part + (with_key ? kBox : 0);
  return frame + (frame > kShortFrame ? kLongHeader : kShortHeader);
}

}  // namespace

Result<std::unique_ptr<LinkMonitor>> LinkMonitor::open(void* context, void* socket, bool with_key) {
  const std::string_view largest(reinterpret_cast<const char*>(&kMaxReceivedPart),
                                 sizeof kMaxReceivedPart);
  TRY(set_option(socket, ZMQ_MAXMSGSIZE, largest));
  auto events = TRY(SocketEvents::open(context, socket, kEvents));
  std::unique_ptr<LinkMonitor> link(new LinkMonitor(socket, std::move(events), with_key));
  if (link->news_.fd() < 0 || link->wake_.fd() < 0) {
    return fail("posed may open no more files; raise their limit (ulimit -n, LimitNOFILE)");
  }
  link->thread_ = std::thread([watched = link.get()] { watched->watch(); });
  return link;
}

LinkMonitor::LinkMonitor(void* socket, SocketEvents events, bool with_key)
    : socket_(socket), with_key_(with_key), events_(std::move(events)) {
  const std::scoped_lock lock(unreceived_mutex);
  unreceived_of_links.push_back(&unreceived_);
}

LinkMonitor::~LinkMonitor() {
  stop_.store(true);
  wake_.signal();
  if (thread_.joinable()) thread_.join();
  const std::scoped_lock lock(unreceived_mutex);
  std::erase(unreceived_of_links, &unreceived_);
}

bool LinkMonitor::note_unreceived(std::uint64_t bytes) noexcept {
  const std::scoped_lock lock(unreceived_mutex);
  unreceived_ = bytes;
  std::uint64_t all = 0;
  std::uint64_t most = 0;
  for (const std::uint64_t* link : unreceived_of_links) {
    all += *link;
    most = std::max(most, *link);
  }
  return all <= kMaxUnreceived || bytes < most;
}

void LinkMonitor::watch() {
  pthread_setname_np(pthread_self(), "posed-link");
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  std::array<pollfd, 2> items{{{.fd = events_.fd(), .events = POLLIN, .revents = 0},
                               {.fd = wake_.fd(), .events = POLLIN, .revents = 0}}};
  while (!stop_.load()) {
    int wait_ms = -1;
    {
      const std::scoped_lock lock(mutex_);
      handle_events();
      inspect();
      if (is_connected()) wait_ms = kTick_ms;
    }
    ::poll(items.data(), items.size(), wait_ms);
    wake_.clear();
  }
}

bool LinkMonitor::receive(Message& part) noexcept {
  const bool received =
      part.receive(socket_) || (zmq_errno() == EAGAIN && !is_empty() && part.receive(socket_));
  if (!received) return false;
  const std::scoped_lock lock(mutex_);
  // What had arrived when nothing waited cannot belong to a message behind this one.
  accounted_ = std::max(accounted_ + wire_bytes(part.text().size(), with_key_), when_empty_);
  return true;
}

bool LinkMonitor::is_empty() noexcept {
  int fd = -1;
  std::uint64_t cookie = 0;
  {
    const std::scoped_lock lock(mutex_);
    fd = fd_;
    cookie = cookie_;
  }
  const std::uint64_t arrived = received_bytes(fd);
  int events = ZMQ_POLLIN;
  std::size_t size = sizeof events;
  static_cast<void>(zmq_getsockopt(socket_, ZMQ_EVENTS, &events, &size));
  if ((events & ZMQ_POLLIN) != 0) return false;
  const std::scoped_lock lock(mutex_);
  const bool same = fd_ == fd && cookie_ == cookie && (fd < 0 || cookie_of(fd) == cookie);
  if (same) when_empty_ = before_ + arrived;
  accounted_ = std::max(accounted_, before_);  // nothing of earlier connections is left
  return true;
}

void LinkMonitor::handle_events() {
  while (const auto event = events_.next()) {
    const Refusal refusal = handle(event->number, event->value);
    if (refusal_ == Refusal::kNone) refusal_ = refusal;
    news_.signal();
  }
}

Refusal LinkMonitor::handle(std::uint16_t event, int value) {
  switch (event) {
    case ZMQ_EVENT_CONNECTED:
      fd_ = value;
      cookie_ = cookie_of(value);
      is_cut_ = false;
      break;
    case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
      state_.established = true;
      hang_ups_ = 0;
      break;
    case ZMQ_EVENT_DISCONNECTED: {
      fd_ = -1;
      before_ += std::exchange(arrived_, 0) + kUnseen;
      static_cast<void>(note_unreceived(0));
      const bool was_cut = std::exchange(is_cut_, false);
      if (was_cut) malloc_trim(0);
      const bool known = std::exchange(failure_known_, false);
      const bool was_established = std::exchange(state_.established, false);
      if (was_established) ++state_.ends;
      // This side was the first to see that the sockets do not match; libzmq tries no more.
      if (!was_established && !known && !was_cut) return Refusal::kOtherSocket;
      break;
    }
    case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH:
      failure_known_ = true;
      return Refusal::kKeyNotAllowed;
    case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
      failure_known_ = true;
      return with_key_ ? Refusal::kTalksNoKeys : Refusal::kWantsKey;
    case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
      failure_known_ = true;
      if (is_cut_) break;
      if (with_key_) return Refusal::kHangsUp;
      if (++hang_ups_ == kHangUps) return Refusal::kHangsUpKeyless;
      break;
    default:
      break;
  }
  return Refusal::kNone;
}

void LinkMonitor::inspect() {
  if (!is_connected() || is_cut_) return;
  arrived_ = received_bytes(fd_);
  const std::uint64_t all = before_ + arrived_;
  accounted_ = std::min(accounted_, all);
  if (note_unreceived(all - accounted_)) return;
  is_cut_ = true;
  // libzmq's thread may have closed the connection since then, and its descriptor may have been
  // reused.
  if (cookie_ == 0 || cookie_of(fd_) != cookie_) return;
  ::shutdown(fd_, SHUT_RDWR);
  ++state_.cuts;
  news_.signal();
}

Refusal LinkMonitor::next_refusal() {
  news_.clear();
  static_cast<void>(is_empty());  // some wait for long before they receive
  const std::scoped_lock lock(mutex_);
  const bool connected = is_connected();
  handle_events();
  if (connected != is_connected()) wake_.signal();  // the thread waits otherwise
  told_ = state_;
  return std::exchange(refusal_, Refusal::kNone);
}

}  // namespace posed::net
