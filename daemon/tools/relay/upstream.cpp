#include "daemon/tools/relay/upstream.hpp"

#include <string_view>

#include <spdlog/spdlog.h>

#include "daemon/net/refusal_words.hpp"
#include "daemon/publish/subscriptions.hpp"
#include "proto/zmq/keys.hpp"

namespace posed::relay {
namespace {

// Messages that wait in this process: the skeletons of many streams come together.
constexpr int kMessagesWaiting = 64;
constexpr int kReceiveBuffer = 16 * 1024;  // bytes
// One part: the stats of 256 streams have about 200 KB.
constexpr std::int64_t kMaxPart = 1024 * 1024;  // bytes
// All subscriptions that there may be, and as many changes of them.
constexpr int kSubscriptionsWaiting = static_cast<int>(2 * publish::kMaxWanted);

}  // namespace

Result<Upstream> Upstream::open(void* context, const UpstreamSettings& settings) {
  auto socket = net::open_socket(context, ZMQ_XSUB);
  if (!socket) return std::unexpected(socket.error());
  if (!settings.key.empty()) {
    auto secured = net::secure_client(socket->get(), settings.key, settings.server_key);
    if (!secured) return std::unexpected(secured.error());
  }
  const std::string_view largest(reinterpret_cast<const char*>(&kMaxPart), sizeof kMaxPart);
  for (const Result<>& set : {net::set_option(socket->get(), ZMQ_MAXMSGSIZE, largest),
                              net::set_option(socket->get(), ZMQ_RCVHWM, kMessagesWaiting),
                              net::set_option(socket->get(), ZMQ_RCVBUF, kReceiveBuffer),
                              net::set_option(socket->get(), ZMQ_SNDHWM, kSubscriptionsWaiting)}) {
    if (!set) return std::unexpected(set.error());
  }
  auto monitor = net::LinkMonitor::open(context, socket->get(), !settings.key.empty());
  if (!monitor) return std::unexpected(monitor.error());
  if (auto done = net::connect_socket(socket->get(), settings.endpoint); !done) {
    return std::unexpected(done.error());
  }
  return Upstream(settings, std::move(*socket), std::move(*monitor));
}

bool Upstream::subscribe(const std::string& prefix, bool on) {
  return net::send_part(socket_.get(), (on ? '\1' : '\0') + prefix, false);
}

bool Upstream::receive(net::Message& topic, net::Message& body, bool& sound) {
  if (!topic.receive(socket_.get())) return false;
  sound = topic.more() && body.receive(socket_.get()) && !body.more();
  if (sound || !topic.more()) return true;
  while (body.more() && body.receive(socket_.get())) {
  }
  return true;
}

void Upstream::take_news() {
  const bool before = monitor_.established();
  const net::Refusal refusal = monitor_.next_refusal();
  if (refusal != net::Refusal::kNone) {
    spdlog::error("the daemon at {} {}", endpoint(),
                  net::refusal_words(refusal, net::Domain::kPublish, settings_.server_key));
  } else if (established() != before) {
    spdlog::log(before ? spdlog::level::warn : spdlog::level::info, "{}: {}", endpoint(),
                before ? "connection lost; it is tried again" : "connected");
  }
}

}  // namespace posed::relay
