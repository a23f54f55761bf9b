#include "daemon/control/control_server.hpp"

#include <array>

#include <unistd.h>

#include "daemon/system/clock.hpp"
#include "daemon/system/realtime.hpp"
#include "posed/v1/control.pb.h"

namespace posed::control {
namespace {

constexpr int kRequestsWaiting = 4;  // per client; more wait at the client
constexpr int kRepliesWaiting = 16;  // per client
constexpr int kReceiveBuffer_bytes = 64 * 1024;
constexpr std::int64_t kMaxPart = kMaxRequest + 1024;  // bytes
// bytes that have not become a request, of all clients together
constexpr std::uint64_t kMaxUnfinished = 512 * 1024;
constexpr int kLinger_ms = 500;          // time to send the reply to `stop`
constexpr int kRequestsARound = 16;      // then acknowledgements are handled
constexpr std::size_t kMaxEnvelope = 4;  // parts before the request

Result<> set_limits(void* router) {
  for (const auto& [option, value] : {std::pair{ZMQ_SNDHWM, kRepliesWaiting},
                                      {ZMQ_LINGER, kLinger_ms},
                                      {ZMQ_ROUTER_HANDOVER, 1}}) {
    TRY(net::set_option(router, option, value));
  }
  return net::set_receive_limits(router, kMaxPart, kRequestsWaiting, kReceiveBuffer_bytes);
}

long milliseconds_until(std::int64_t due_ns) {
  return static_cast<long>(system::time_left_ns(due_ns, system::monotonic_ns) / 1'000'000 + 1);
}

}  // namespace

Result<std::unique_ptr<ControlServer>> ControlServer::start(void* context,
                                                            const std::string& endpoint,
                                                            const ControlPorts& ports,
                                                            RequestHandler& handler) {
  auto router = TRY(net::open_socket(context, ZMQ_ROUTER));
  TRY(set_limits(router.get()));
  if (ports.authenticator != nullptr) {
    TRY(net::secure_server(router.get(), net::Domain::kControl, ports.secret_z85));
  }
  auto guard = TRY(net::PeerGuard::open(context, router.get(),
                                        {.name = "control",
                                         .max_peers = net::peer_shares().control,
                                         .max_unfinished = kMaxUnfinished,
                                         .max_unfinished_of_all = kMaxUnfinished,
                                         .authenticator = ports.authenticator}));
  auto bound = TRY(net::bind_socket(router.get(), endpoint));
  return std::unique_ptr<ControlServer>(
      new ControlServer(std::move(router), std::move(guard), std::move(bound), ports, handler));
}

ControlServer::ControlServer(net::Socket router, std::unique_ptr<net::PeerGuard> guard,
                             std::string endpoint, const ControlPorts& ports,
                             RequestHandler& handler)
    : router_(std::move(router)),
      guard_(std::move(guard)),
      endpoint_(std::move(endpoint)),
      ports_(ports),
      handler_(handler),
      thread_([this] { serve(); }) {}

ControlServer::~ControlServer() {
  stop_.store(true, std::memory_order_release);
  ports_.wake->notify();
  thread_.join();
}

void ControlServer::serve() {
  system::name_thread(kThreadName);
  while (!stop_.load(std::memory_order_acquire)) {
    bool busy = false;
    // A large model takes a second, so each request is a sign of life.
    for (int i = 0; i < kRequestsARound; ++i) {
      handler_.pulse().beat();
      if (!handle_request()) break;
      busy = true;
    }
    while (handle_ack()) busy = true;
    if (handler_.is_listing()) {
      busy = true;
      if (auto reply = handler_.list_on()) send(*reply);
    }
    handler_.use_taught();
    const std::int64_t due_ns = handler_.forget_old(system::monotonic_ns());
    if (!busy) sleep(milliseconds_until(due_ns));
  }
}

void ControlServer::sleep(long longest_ms) {
  ports_.wake->going_to_sleep();
  handler_.use_taught();  // here, too: a call that came before going_to_sleep() wakes nobody
  if (ports_.acks->empty() && !stop_.load(std::memory_order_acquire)) {
    std::array<zmq_pollitem_t, 2> wait{
        {{router_.get(), 0, ZMQ_POLLIN, 0}, {nullptr, ports_.wake->fd(), ZMQ_POLLIN, 0}}};
    zmq_poll(wait.data(), static_cast<int>(wait.size()), longest_ms);
    std::uint64_t rung = 0;
    [[maybe_unused]] const ssize_t cleared = read(ports_.wake->fd(), &rung, sizeof rung);
  }
  ports_.wake->awake();
}

bool ControlServer::handle_request() {
  net::Message part;
  if (!part.receive(router_.get())) return false;
  Requester envelope;
  while (part.more()) {
    if (envelope.size() <= kMaxEnvelope) envelope.emplace_back(part.text());
    if (!part.receive(router_.get(), 0)) return true;  // libzmq hands over whole messages
  }
  if (envelope.size() > kMaxEnvelope) return true;  // not a client of this protocol: no reply
  ++requests_;
  (void)guard_->drain_ended();  // this socket keeps no state for a connection
  if (const int client = net::source_of(part); guard_->knows(client)) guard_->received(client, {});
  if (ports_.authenticator != nullptr &&
      !ports_.authenticator->allows(part.property("User-Id"), net::Domain::kControl)) {
    v1::ControlReply reply;
    reply.set_error("your key may no longer control this daemon");
    send({.to = std::move(envelope), .bytes = reply.SerializeAsString(), .refused = true});
    return true;
  }
  if (auto reply = handler_.handle(std::move(envelope), part.bytes())) send(*reply);
  return true;
}

bool ControlServer::handle_ack() {
  std::optional<Reply> reply;
  const bool handled =
      ports_.acks->consume([&](const pipeline::Ack& ack) { reply = handler_.acknowledge(ack); });
  if (reply) send(*reply);
  return handled;
}

// A ROUTER socket drops a reply that a slow or disconnected client does not accept.
void ControlServer::send(const Reply& reply) {
  if (reply.refused) ++refusals_;
  net::update_peers(router_.get());
  for (const std::string& part : reply.to) {
    if (!net::send_part(router_.get(), part, true)) return;
  }
  (void)net::send_part(router_.get(), reply.bytes, false);
}

}  // namespace posed::control
