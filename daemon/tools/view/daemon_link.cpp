#include "daemon/tools/view/daemon_link.hpp"

#include <array>
#include <cstring>
#include <span>
#include <utility>

#include <spdlog/spdlog.h>
#include <boost/asio/post.hpp>

#include "daemon/system/clock.hpp"
#include "proto/frame/time.hpp"
#include "proto/message/bounded_parse.hpp"

namespace posed::view {
namespace {

constexpr int kMessagesAtOnce = 256;                             // then the pages have their turn
constexpr std::int64_t kSilent_ns = 3 * kNanosPerSecond;         // three stats are missing
constexpr std::int64_t kControlAgain_ns = 60 * kNanosPerSecond;  // such a page may well be wanted
constexpr std::int64_t kStatusWithin_ns = 5 * kNanosPerSecond;
constexpr std::uint64_t kStatusTicket = 0;  // the pages' requests have others
constexpr std::array kAlways{"stats", "skeleton/"};
constexpr std::array kWithPages{"pose/", "sensor/", "event/"};

}  // namespace

Result<std::unique_ptr<WatchedSocket>> WatchedSocket::open(boost::asio::io_context& io,
                                                           void* context, int type,
                                                           const link::Peer& peer,
                                                           std::function<bool()> drain) {
  auto socket =
      TRY(link::DaemonSocket::open(context, type, peer, {.only_connected = type == ZMQ_DEALER}));
  int fd = -1;
  std::size_t size = sizeof fd;
  if (zmq_getsockopt(socket.get(), ZMQ_FD, &fd, &size) != 0) {
    return fail("the bridge cannot wait for its connection to the daemon");
  }
  return std::unique_ptr<WatchedSocket>(
      new WatchedSocket(std::move(socket), io, fd, std::move(drain)));
}

WatchedSocket::WatchedSocket(link::DaemonSocket socket, boost::asio::io_context& io, int fd,
                             std::function<bool()> drain)
    : socket_(std::move(socket)), drain_(std::move(drain)), descriptor_(io, fd) {}

WatchedSocket::~WatchedSocket() {
  *alive_ = false;
  descriptor_.release();
}

void WatchedSocket::turn() {
  if (drain_()) {
    wait();
  } else {
    turn_soon();
  }
}

void WatchedSocket::turn_soon() {
  boost::asio::post(descriptor_.get_executor(), [this, alive = alive_] {
    if (*alive) turn();
  });
}

// The descriptor shows only that something has happened since it was read last, so it is waited for
// when nothing waits any more.
void WatchedSocket::wait() {
  if (std::exchange(waiting_, true)) return;
  descriptor_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                         [this, alive = alive_](const boost::system::error_code& error) {
                           if (!*alive) return;
                           waiting_ = false;
                           if (!error) turn();
                         });
}

Result<std::unique_ptr<DaemonLink>> DaemonLink::open(boost::asio::io_context& io, void* context,
                                                     const LinkOptions& options, Hub& hub) {
  std::unique_ptr<DaemonLink> link(new DaemonLink(io, context, options, hub));
  hub.daemon_is({.alive = false,
                 .sentence = "waiting for the daemon at " + options.publish.endpoint +
                             "; is `posed run` going, and is this its publish endpoint?"});
  TRY(link->open_publish());
  if (!options.read_only_reason.empty()) {
    hub.control_is({.may = false, .reason = options.read_only_reason});
    return link;
  }
  TRY(link->open_control());
  return link;
}

Result<> DaemonLink::open_publish() {
  auto socket = TRY(WatchedSocket::open(io_, context_, ZMQ_SUB, options_.publish,
                                        [this] { return receive_messages(); }));
  publish_again_.opened();
  publish_ = std::move(socket);
  publish_ends_ = 0;
  for (const char* prefix : kAlways) {
    TRY(subscribe(prefix, true));
  }
  if (std::exchange(wants_streams_, false)) want_streams(true);
  publish_->turn_soon();
  return {};
}

Result<> DaemonLink::open_control() {
  link::Peer peer = options_.publish;
  peer.endpoint = options_.control;
  auto socket = TRY(
      WatchedSocket::open(io_, context_, ZMQ_DEALER, peer, [this] { return receive_replies(); }));
  control_again_.opened();
  asked_ns_.reset();
  control_ = std::move(socket);
  control_ends_ = 0;
  control_stood_ = false;
  control_->turn_soon();
  return {};
}

Result<> DaemonLink::subscribe(const char* prefix, bool on) {
  return net::set_option(publish_->socket().get(), on ? ZMQ_SUBSCRIBE : ZMQ_UNSUBSCRIBE,
                         std::string_view(prefix));
}

void DaemonLink::want_streams(bool wanted) {
  if (std::exchange(wants_streams_, wanted) == wanted) return;
  for (const char* prefix : kWithPages) {
    if (auto set = subscribe(prefix, wanted); !set) spdlog::error("{}", set.error().text());
  }
  publish_->turn_soon();
}

bool DaemonLink::ask(std::uint64_t ticket, std::string_view request) {
  if (!control_) return false;
  const std::string_view number(reinterpret_cast<const char*>(&ticket), sizeof ticket);
  const bool sent = net::send_part(control_->socket().get(), number, true) &&
                    net::send_part(control_->socket().get(), request, false);
  control_->turn_soon();
  return sent;
}

bool DaemonLink::receive_messages() {
  const std::int64_t now_ns = system::monotonic_ns();
  // Before the messages of a new connection: what is known of the daemon before must not mix in.
  handle_news(now_ns);
  net::Message topic;
  net::Message body;
  link::DaemonSocket& socket = publish_->socket();
  bool more = true;
  for (int i = 0; i < kMessagesAtOnce && more; ++i) {
    const link::Received received = socket.receive(topic, body);
    more = received != link::Received::kNothing;
    if (received != link::Received::kMessage) continue;
    received_ns_ = now_ns;
    if (!hub_.daemon().alive && socket.established()) hub_.daemon_is({.alive = true});
    hub_.receive(topic.text(), body.text(), now_ns);
  }
  hub_.flush();
  return !more;
}

bool DaemonLink::receive_replies() {
  net::Message number, reply;
  for (int i = 0; i < kMessagesAtOnce; ++i) {
    const link::Received received = control_->socket().receive(number, reply);
    if (received == link::Received::kNothing) return true;
    std::uint64_t ticket = 0;
    if (received != link::Received::kMessage || number.text().size() != sizeof ticket) continue;
    std::memcpy(&ticket, number.text().data(), sizeof ticket);
    if (ticket == kStatusTicket) {
      handle_status(reply.text());
    } else {
      hub_.replied(ticket, reply.text());
    }
  }
  return false;
}

void DaemonLink::handle_news(std::int64_t now_ns) {
  link::DaemonSocket& socket = publish_->socket();
  const std::string why = socket.refusal();
  const std::string daemon = "the daemon at " + options_.publish.endpoint;
  if (socket.ends() != publish_ends_) {
    publish_ends_ = socket.ends();
    hub_.daemon_is({.alive = false, .sentence = daemon + " has gone; it is tried again"});
    publish_again_.failed(now_ns);
    // It may come back with other keys.
    if (control_again_.is_waiting()) control_again_.failed(now_ns, 0);
  }
  if (!why.empty()) {
    hub_.daemon_is({.alive = false, .sentence = daemon + " " + why});
    publish_again_.failed(now_ns);
  }
}

void DaemonLink::check_control(std::int64_t now_ns) {
  link::DaemonSocket& socket = control_->socket();
  const std::string why = socket.refusal();
  const std::string daemon = "the daemon at " + options_.control;
  if (!why.empty()) {
    hub_.control_is({.may = false, .reason = daemon + " " + why});
    control_again_.failed(now_ns, kControlAgain_ns);
    return;
  }
  const bool ended = std::exchange(control_ends_, socket.ends()) != socket.ends();
  const bool anew = ended || !control_stood_;
  control_stood_ = socket.established();
  if (!control_stood_) {
    if (!control_again_.is_waiting()) {
      hub_.control_is({.may = false,
                       .reason = "nothing answers at " + options_.control +
                                 ", the daemon's control endpoint (--control)"});
    }
    if (ended) control_again_.failed(now_ns);
    return;
  }
  if (anew) return ask_for_status(now_ns);
  if (!asked_ns_ || now_ns - *asked_ns_ < kStatusWithin_ns) return;
  hub_.control_is(
      {.may = false, .reason = daemon + " does not answer; is this its control endpoint?"});
  ask_for_status(now_ns);
}

void DaemonLink::ask_for_status(std::int64_t now_ns) {
  v1::ControlRequest request;
  request.mutable_status();
  asked_ns_ = now_ns;  // what cannot be sent is asked again
  static_cast<void>(ask(kStatusTicket, request.SerializeAsString()));
}

void DaemonLink::handle_status(std::string_view bytes) {
  v1::ControlReply reply;
  if (!message::parse_bounded(reply, std::as_bytes(std::span(bytes)))) return;
  asked_ns_.reset();
  hub_.control_is({.may = reply.ok(), .reason = reply.error()});
}

void DaemonLink::connect_anew(std::int64_t now_ns) {
  Result<> opened;
  if (publish_again_.due(now_ns, publish_->socket().established())) opened = open_publish();
  if (opened && control_ && control_again_.due(now_ns, control_->socket().established())) {
    opened = open_control();
  }
  if (!opened) spdlog::error("the bridge cannot connect anew: {}", opened.error().text());
}

void DaemonLink::turn(std::int64_t now_ns) {
  connect_anew(now_ns);
  publish_->turn();
  if (hub_.daemon().alive && now_ns - received_ns_ > kSilent_ns) {
    hub_.daemon_is({.alive = false,
                    .sentence = "the daemon at " + options_.publish.endpoint +
                                " has been silent for 3 s: it "
                                "is stopped or stuck"});
  }
  if (!control_) return;
  check_control(now_ns);
  control_->turn();
}

}  // namespace posed::view
