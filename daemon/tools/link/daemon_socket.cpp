#include "daemon/tools/link/daemon_socket.hpp"

#include "daemon/net/security.hpp"
#include "proto/zmq/keys.hpp"

namespace posed::link {

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
  return net::refusal_words(monitor_->next_refusal(), domain_, peer_.server_key);
}

}  // namespace posed::link
