#include "daemon/publish/publish_socket.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/net/peer_guard.hpp"
#include "daemon/net/security.hpp"

namespace posed::publish {
namespace {

constexpr double kQueueDepth_s = 0.25;
constexpr int kMinQueue = 16;
// The longest part that a subscriber may send: it holds a CURVE handshake and a long name. After
// that come subscriptions, one at a time, so that a flood of them is received no faster than it is
// processed.
constexpr std::int64_t kMaxPart = 512;  // bytes
// At least two: through a queue of one, libzmq 4.3.4 delivers nothing from a peer that uses CURVE.
constexpr int kSubscriptionsWaiting = 2;
constexpr int kReceiveBuffer_bytes = 8 * 1024;
// Bytes of one peer that have not become a message: the kernel and libzmq hold up to 16 KB before
// the owner receives anything.
constexpr std::uint64_t kMaxUnfinished = 24 * 1024;
constexpr std::uint64_t kMaxUnfinishedOfAll = 512 * 1024;
constexpr int kSubscriptionsATurn = 64;
// bytes; the kernel's default alone can hold seconds of old poses
constexpr int kSendBuffer = 8 * 1024;

}  // namespace

int send_high_water_mark(double messages_per_s) {
  return std::max(kMinQueue, static_cast<int>(std::ceil(messages_per_s * kQueueDepth_s)));
}

Result<> set_queue_options(void* socket, double messages_per_s) {
  const int depth = send_high_water_mark(messages_per_s);
  TRY(net::set_option(socket, ZMQ_SNDHWM, depth));
  return net::set_option(socket, ZMQ_SNDBUF, kSendBuffer);
}

Result<PublishSocket> PublishSocket::open(const PublishSocketSettings& settings) {
  auto socket = TRY(net::open_socket(settings.context, ZMQ_XPUB));
  TRY(set_queue_options(socket.get(), settings.messages_per_s));
  TRY(net::set_option(socket.get(), ZMQ_XPUB_VERBOSER, 1));
  if (settings.authenticator != nullptr) {
    TRY(net::secure_server(socket.get(), net::Domain::kPublish, settings.secret_z85));
  }
  TRY(net::set_receive_limits(socket.get(), kMaxPart, kSubscriptionsWaiting, kReceiveBuffer_bytes));
  auto guard = TRY(net::PeerGuard::open(settings.context, socket.get(),
                                        {.name = "publish",
                                         .max_peers = net::peer_shares().publish,
                                         .max_unfinished = kMaxUnfinished,
                                         .max_unfinished_of_all = kMaxUnfinishedOfAll,
                                         .authenticator = settings.authenticator}));
  auto endpoint = TRY(net::bind_socket(socket.get(), settings.endpoint));
  return PublishSocket(std::move(socket), std::move(guard), std::move(endpoint));
}

PublishSocket::PublishSocket(net::Socket socket, std::unique_ptr<net::PeerGuard> guard,
                             std::string endpoint)
    : socket_(std::move(socket)), guard_(std::move(guard)), endpoint_(std::move(endpoint)) {}

PublishSocket::~PublishSocket() = default;
PublishSocket::PublishSocket(PublishSocket&&) noexcept = default;

// A subscription message is one byte (1: subscribe, 0: unsubscribe), then the beginning of a topic.
bool PublishSocket::receive_subscriptions(
    Subscriptions& subscriptions, std::int64_t now_ns,
    const std::function<void(std::string_view prefix)>& subscribed) {
  for (const int peer : guard_->drain_ended()) subscriptions.forget(peer);
  net::Message message;
  for (int i = 0; i < kSubscriptionsATurn; ++i) {
    if (!message.receive(socket_.get())) return true;
    const std::string_view text = message.text();
    const int peer = net::source_of(message);
    // gone meanwhile, or libzmq unsubscribes for a peer that is gone
    if (!guard_->knows(peer)) continue;
    guard_->received(peer, message.property("User-Id"));
    if (text.empty() || static_cast<unsigned char>(text.front()) > 1) {
      guard_->cut(peer, "sent an invalid subscription");
    } else if (!subscriptions.ask(peer, text.substr(1), text.front() == 1, now_ns)) {
      guard_->cut(peer, "subscribed to too much");
    } else if (text.front() == 1) {
      subscribed(text.substr(1));
    }
  }
  return false;
}

}  // namespace posed::publish
