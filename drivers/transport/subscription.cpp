#include "drivers/transport/subscription.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <mutex>
#include <span>
#include <utility>

#include <pthread.h>
#include <sys/socket.h>
#include <unistd.h>

#include "proto/zmq/keys.hpp"

namespace posed::drivers {
namespace {

constexpr std::chrono::milliseconds kPatience{1000};
constexpr int kMessagesWaiting = 16;   // in libzmq
constexpr int kLinkBuffer = 8 * 1024;  // bytes, in the kernel before libzmq
// A message that is only too long to be a chunk is counted, and costs no connection.
static_assert(net::kMaxReceivedPart > std::int64_t{kMaxChunk});
// Bytes between thread and reader, which the kernel doubles for its own use: a quarter of a second
// of a large skeleton at 120 Hz.
constexpr int kQueue = 128 * 1024;
constexpr int kMaxDiscarded = 256;  // for one message; more than the queue holds
constexpr int kLinkThreads = 2;     // the monitor's, and the one that receives

Error refusal_error(net::Refusal refusal, const SubscriptionSettings& settings) {
  const std::string daemon = "the daemon at " + settings.endpoint;
  switch (refusal) {
    case net::Refusal::kKeyNotAllowed:
      return fail(daemon + " refuses this key: it is not on its list, or may not subscribe")
          .error();
    case net::Refusal::kTalksNoKeys:
      return fail(daemon + " does not use keys, or is not posed; leave out key and server_key")
          .error();
    case net::Refusal::kHangsUp:
      return fail(daemon + " hangs up: " + settings.server_key.string() +
                  " is not its key, or it just ended")
          .error();
    case net::Refusal::kWantsKey:
      return fail(daemon + " wants a key; set key = \"NAME.key\" and server_key = \"SERVER.pub\"")
          .error();
    case net::Refusal::kOtherSocket:
      return fail(daemon + " hangs up: this is not its publish endpoint").error();
    case net::Refusal::kHangsUpKeyless:
      return fail(daemon +
                  " hangs up: it wants a key (key = \"NAME.key\" and server_key ="
                  " \"SERVER.pub\"), or this is not its publish endpoint")
          .error();
    case net::Refusal::kNone:
      break;
  }
  return fail("nothing answers at " + settings.endpoint + "; is posed running there?").error();
}

Result<> set_all(void* socket, const SubscriptionSettings& settings) {
  for (const Result<>& set : {net::set_option(socket, ZMQ_RCVHWM, kMessagesWaiting),
                              net::set_option(socket, ZMQ_RCVBUF, kLinkBuffer)}) {
    if (!set) return set;
  }
  for (const std::string& topic : settings.topics) {
    TRY(net::set_option(socket, ZMQ_SUBSCRIBE, topic));
  }
  if (settings.key.empty()) return {};
  return net::secure_client(socket, settings.key, settings.server_key);
}

}  // namespace

Result<> check_subscription(const SubscriptionSettings& settings) {
  if (!settings.endpoint.starts_with("tcp://") && !settings.endpoint.starts_with("ipc://")) {
    return misuse("'" + settings.endpoint +
                  "' is not an endpoint; it looks like tcp://192.168.1.10:5570");
  }
  if (settings.key.empty() != settings.server_key.empty()) {
    return misuse("key and server_key belong together: set both, or none");
  }
  if (settings.key.empty()) return {};
  TRY(net::read_secret_key(settings.key));
  TRY(net::read_public_key(settings.server_key));
  return {};
}

Result<std::shared_ptr<net::Context>> subscription_context() {
  static std::mutex mutex;
  static std::weak_ptr<net::Context> open;
  const std::scoped_lock lock(mutex);
  if (auto known = open.lock()) {
    TRY(net::check_threads(kLinkThreads));
    return known;
  }
  auto context = TRY(net::open_context());
  auto made = std::make_shared<net::Context>(std::move(context));
  open = made;
  return made;
}

Result<std::unique_ptr<SubscriptionTransport>> SubscriptionTransport::open(
    const SubscriptionSettings& settings, const Cancel& cancel,
    std::shared_ptr<net::Context> context, std::shared_ptr<PausedHosts> paused) {
  std::unique_ptr<SubscriptionTransport> made(
      new SubscriptionTransport(settings, std::move(context), std::move(paused)));
  TRY(made->connect());
  TRY(made->await_link(cancel));
  made->thread_ = std::thread([transport = made.get()] { transport->receive_all(); });
  return made;
}

SubscriptionTransport::SubscriptionTransport(const SubscriptionSettings& settings,
                                             std::shared_ptr<net::Context> context,
                                             std::shared_ptr<PausedHosts> paused)
    : settings_(settings),
      paused_(std::move(paused)),
      context_(std::move(context)),
      outgoing_(kMaxChunk),
      incoming_(kMaxChunk) {}

SubscriptionTransport::~SubscriptionTransport() {
  stop_.signal();
  if (thread_.joinable()) thread_.join();
  if (flood_.has_ended()) paused_->add(PausedHosts::kOurs);
  for (const int fd : {reader_, writer_}) {
    if (fd >= 0) ::close(fd);
  }
}

Result<> SubscriptionTransport::connect() {
  std::array<int, 2> ends{};
  if (stop_.fd() < 0 ||
      ::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()) != 0) {
    return fail("posed may open no more files; raise their limit (ulimit -n, LimitNOFILE)");
  }
  reader_ = ends[0];
  writer_ = ends[1];
  ::setsockopt(writer_, SOL_SOCKET, SO_SNDBUF, &kQueue, sizeof kQueue);
  socket_ = TRY(net::open_socket(context_->get(), ZMQ_SUB));
  TRY(set_all(socket_.get(), settings_));
  monitor_ = TRY(net::LinkMonitor::open(context_->get(), socket_.get(), !settings_.key.empty()));
  return net::connect_socket(socket_.get(), settings_.endpoint);
}

Result<> SubscriptionTransport::await_link(const Cancel& cancel) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  std::array<zmq_pollitem_t, 2> items{
      {{nullptr, monitor_->fd(), ZMQ_POLLIN, 0}, {nullptr, cancel.fd(), ZMQ_POLLIN, 0}}};
  while (!cancel.fired()) {
    const net::Refusal refusal = monitor_->next_refusal();
    if (refusal != net::Refusal::kNone) return std::unexpected(refusal_error(refusal, settings_));
    if (monitor_->established()) return {};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return std::unexpected(refusal_error(net::Refusal::kNone, settings_));
    zmq_poll(items.data(), items.size(), left.count());
  }
  return Cancel::error();
}

void SubscriptionTransport::receive_all() {
  pthread_setname_np(pthread_self(), "posed-upstream");
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);
  std::array<zmq_pollitem_t, 3> items{{{socket_.get(), 0, ZMQ_POLLIN, 0},
                                       {nullptr, monitor_->fd(), ZMQ_POLLIN, 0},
                                       {nullptr, stop_.fd(), ZMQ_POLLIN, 0}}};
  while (monitor_->next_refusal() == net::Refusal::kNone && monitor_->ends() == 0) {
    zmq_poll(items.data(), items.size(), -1);
    if ((items[2].revents & ZMQ_POLLIN) != 0) return;
    if ((items[0].revents & ZMQ_POLLIN) != 0) accept_message();
  }
  ::shutdown(writer_, SHUT_WR);  // the reader finds the end behind the last message
}

void SubscriptionTransport::accept_message() {
  net::Message topic;
  net::Message body;
  if (!monitor_->receive(topic)) return;
  const bool valid = topic.more() && monitor_->receive(body) && !body.more();
  while (topic.more() && body.more() && monitor_->receive(body)) {
  }
  const auto name = topic.bytes();
  const auto content = body.bytes();
  const std::size_t size = name.size() + 1 + content.size();
  if (!valid || size > outgoing_.size()) {
    damaged_.fetch_add(1);
    return;
  }
  if (std::ranges::find(settings_.topics, topic.text()) == settings_.topics.end()) return;
  std::memcpy(outgoing_.data(), name.data(), name.size());
  outgoing_[name.size()] = std::byte{0};
  if (!content.empty()) std::memcpy(&outgoing_[name.size() + 1], content.data(), content.size());
  hand_over(size);
}

void SubscriptionTransport::hand_over(std::size_t size) noexcept {
  std::byte discarded{};
  for (int i = 0; i < kMaxDiscarded; ++i) {
    if (::send(writer_, outgoing_.data(), size, MSG_DONTWAIT | MSG_NOSIGNAL) >= 0) return;
    if (errno != EAGAIN && errno != ENOBUFS) break;
    // Both ends are of this process, so the oldest message can be taken from the reader's.
    if (::recv(reader_, &discarded, sizeof discarded, MSG_DONTWAIT) > 0) dropped_.fetch_add(1);
  }
  dropped_.fetch_add(1);
}

Result<> SubscriptionTransport::start(std::int64_t now_ns) {
  number_ = static_cast<std::uint64_t>(now_ns) | Chunk::kLink;
  return {};
}

Chunk SubscriptionTransport::read(std::int64_t now_ns) noexcept {
  Chunk chunk;
  if (flood_.has_ended()) {
    chunk.lost = true;
    chunk.foreign = 1;
    return chunk;
  }
  const ssize_t size = ::recv(reader_, incoming_.data(), incoming_.size(), MSG_DONTWAIT);
  if (size == 0) {
    chunk.lost = true;
    return chunk;
  }
  if (size > 0) {
    chunk.bytes = std::span(incoming_).first(size);
    chunk.sender = number_;
    flood_.read(chunk.bytes.size(), now_ns);
  }
  chunk.damaged = damaged_.exchange(0);
  chunk.kernel_dropped = dropped_.exchange(0);
  return chunk;
}

std::string SubscriptionTransport::consume_note() {
  if (!flood_.has_ended() || std::exchange(is_reported_, true)) return {};
  return Flood::words("the daemon at " + settings_.endpoint);
}

}  // namespace posed::drivers
