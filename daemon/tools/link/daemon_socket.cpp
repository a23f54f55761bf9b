#include "daemon/tools/link/daemon_socket.hpp"

#include "proto/zmq/keys.hpp"

namespace posed::link {
namespace {

std::string other_socket(net::Domain domain) {
  return std::string("this is not its ") +
         (domain == net::Domain::kPublish ? "publish" : "control") +
         " endpoint (by default 5570 publishes, 5571 takes control)";
}

// The words that follow "the daemon at ENDPOINT ..."; empty for Refusal::kNone.
std::string refusal_words(net::Refusal refusal, net::Domain domain,
                          const std::filesystem::path& server_key) {
  using net::Refusal;
  switch (refusal) {
    case Refusal::kNone:
      break;
    case Refusal::kKeyNotAllowed:
      return std::string("refuses this key: it is not on its list, or may not ") +
             (domain == net::Domain::kPublish ? "subscribe" : "control");
    case Refusal::kTalksNoKeys:
      return "does not use keys, or is not posed; leave out --key";
    case Refusal::kHangsUp:
      return "hangs up: --server-key " + server_key.string() + " is not its key, or it just ended";
    case Refusal::kWantsKey:
      return "wants a key; give --key NAME.key --server-key SERVER.pub";
    case Refusal::kOtherSocket:
      return "hangs up: " + other_socket(domain);
    case Refusal::kHangsUpKeyless:
      return "hangs up: it wants a key (--key NAME.key --server-key SERVER.pub), or " +
             other_socket(domain);
  }
  return {};
}

}  // namespace

Result<DaemonSocket> DaemonSocket::open(void* context, int type, Peer peer, const Limits& limits) {
  auto socket = TRY(net::open_socket(context, type));
  const bool keys = !peer.key.empty();
  if (keys) {
    TRY(net::secure_client(socket.get(), peer.key, peer.server_key));
  }
  for (const Result<>& set :
       {net::set_option(socket.get(), ZMQ_RCVHWM, limits.messages),
        net::set_option(socket.get(), ZMQ_RCVBUF, limits.receive_buffer),
        net::set_option(socket.get(), ZMQ_SNDHWM, limits.requests),
        net::set_option(socket.get(), ZMQ_IMMEDIATE, limits.only_connected ? 1 : 0)}) {
    if (!set) return std::unexpected(set.error());
  }
  auto monitor = TRY(net::LinkMonitor::open(context, socket.get(), keys));
  TRY(net::connect_socket(socket.get(), peer.endpoint));
  const auto domain = type == ZMQ_DEALER ? net::Domain::kControl : net::Domain::kPublish;
  return DaemonSocket(std::move(peer), domain, std::move(socket), std::move(monitor));
}

Received DaemonSocket::receive(net::Message& first, net::Message& second) noexcept {
  if (!receive(first)) return Received::kNothing;
  if (!first.more()) return Received::kMalformed;
  const bool whole = receive(second) && !second.more();
  while (second.more() && receive(second)) {
  }
  return whole ? Received::kMessage : Received::kMalformed;
}

std::string DaemonSocket::refusal() {
  return refusal_words(monitor_->next_refusal(), domain_, peer_.server_key);
}

bool Retry::due(std::int64_t now_ns, bool established) {
  if (established) at_ns_.reset();
  if (!at_ns_ || now_ns < *at_ns_) return false;
  at_ns_ = now_ns + kPause_ns;
  return true;
}

}  // namespace posed::link
