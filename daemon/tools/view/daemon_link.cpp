#include "daemon/tools/view/daemon_link.hpp"

#include <array>
#include <cstring>
#include <utility>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <boost/asio/post.hpp>

#include "daemon/net/refusal_words.hpp"
#include "daemon/system/clock.hpp"
#include "proto/frame/time.hpp"
#include "proto/zmq/keys.hpp"

namespace posed::view {
namespace {

// Messages that wait in this process: the skeletons of many streams come together.
constexpr int kMessagesWaiting = 64;
constexpr int kReceiveBuffer = 16 * 1024;       // bytes
constexpr std::int64_t kMaxPart = 1024 * 1024;  // bytes; the stats of 256 streams have 200 KB
constexpr int kMessagesAtOnce = 256;            // then the pages have their turn
constexpr std::int64_t kSilent_ns = 3 * kNanosPerSecond;  // three stats are missing
// A refused key may be allowed later. Each try costs the daemon a line in its log.
constexpr std::int64_t kPublishAgain_ns = 5 * kNanosPerSecond;
constexpr std::int64_t kControlAgain_ns = 60 * kNanosPerSecond;  // such a page may well be wanted
constexpr std::int64_t kTryAgain_ns = 5 * kNanosPerSecond;
constexpr std::int64_t kStatusWithin_ns = 5 * kNanosPerSecond;
constexpr std::uint64_t kStatusTicket = 0;  // the pages' requests have others
constexpr std::array kAlways{"stats", "skeleton/"};
constexpr std::array kWithPages{"pose/", "sensor/", "event/"};

Result<> set_client_options(void* socket, int type) {
  const std::string_view largest(reinterpret_cast<const char*>(&kMaxPart), sizeof kMaxPart);
  for (const Result<>& set : {net::set_option(socket, ZMQ_MAXMSGSIZE, largest),
                              net::set_option(socket, ZMQ_RCVHWM, kMessagesWaiting),
                              net::set_option(socket, ZMQ_RCVBUF, kReceiveBuffer)}) {
    if (!set) return set;
  }
  if (type != ZMQ_DEALER) return {};
  // Without this a request would wait for a daemon that is not there, and take effect much later.
  if (auto set = net::set_option(socket, ZMQ_IMMEDIATE, 1); !set) return set;
  return net::set_option(socket, ZMQ_SNDHWM, kMessagesWaiting);
}

}  // namespace

Result<std::unique_ptr<WatchedSocket>> WatchedSocket::open(boost::asio::io_context& io,
                                                           void* context, int type,
                                                           const LinkOptions& options,
                                                           std::function<bool()> drain) {
  auto socket = net::open_socket(context, type);
  if (!socket) return std::unexpected(socket.error());
  if (!options.key.empty()) {
    auto secured = net::secure_client(socket->get(), options.key, options.server_key);
    if (!secured) return std::unexpected(secured.error());
  }
  if (auto set = set_client_options(socket->get(), type); !set) {
    return std::unexpected(set.error());
  }
  auto monitor = net::LinkMonitor::open(context, socket->get(), !options.key.empty());
  if (!monitor) return std::unexpected(monitor.error());
  const std::string& endpoint = type == ZMQ_SUB ? options.connect : options.control;
  if (auto done = net::connect_socket(socket->get(), endpoint); !done) {
    return std::unexpected(done.error());
  }
  int fd = -1;
  std::size_t size = sizeof fd;
  if (zmq_getsockopt(socket->get(), ZMQ_FD, &fd, &size) != 0) {
    return fail("the bridge cannot wait for its connection to the daemon");
  }
  return std::unique_ptr<WatchedSocket>(
      new WatchedSocket(std::move(*socket), std::move(*monitor), io, fd, std::move(drain)));
}

WatchedSocket::WatchedSocket(net::Socket socket, net::LinkMonitor monitor,
                             boost::asio::io_context& io, int fd, std::function<bool()> drain)
    : socket_(std::move(socket)),
      monitor_(std::move(monitor)),
      drain_(std::move(drain)),
      descriptor_(io, fd) {}

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

// The descriptor tells only that something has happened since it was read last, so it is waited for
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
                 .sentence = "waiting for the daemon at " + options.connect +
                             "; is `posed run` going, and is this its publish endpoint?"});
  if (auto opened = link->open_publish(); !opened) return std::unexpected(opened.error());
  if (!options.read_only_reason.empty()) {
    hub.control_is({.may = false, .reason = options.read_only_reason});
    return link;
  }
  if (auto opened = link->open_control(); !opened) return std::unexpected(opened.error());
  return link;
}

Result<> DaemonLink::open_publish() {
  auto socket = WatchedSocket::open(io_, context_, ZMQ_SUB, options_, [this] { return hear(); });
  if (!socket) return std::unexpected(socket.error());
  publish_again_ns_.reset();
  publish_ = std::move(*socket);
  publish_ends_ = 0;
  for (const char* prefix : kAlways) {
    if (auto set = subscribe(prefix, true); !set) return set;
  }
  if (std::exchange(wants_streams_, false)) want_streams(true);
  publish_->turn_soon();
  return {};
}

Result<> DaemonLink::open_control() {
  auto socket =
      WatchedSocket::open(io_, context_, ZMQ_DEALER, options_, [this] { return hear_replies(); });
  if (!socket) return std::unexpected(socket.error());
  control_again_ns_.reset();
  asked_ns_.reset();
  control_ = std::move(*socket);
  control_ends_ = 0;
  control_stood_ = false;
  control_->turn_soon();
  return {};
}

Result<> DaemonLink::subscribe(const char* prefix, bool on) {
  return net::set_option(publish_->get(), on ? ZMQ_SUBSCRIBE : ZMQ_UNSUBSCRIBE,
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
  const bool sent = net::send_part(control_->get(), number, true) &&
                    net::send_part(control_->get(), request, false);
  control_->turn_soon();
  return sent;
}

bool DaemonLink::hear() {
  const std::int64_t now_ns = system::monotonic_ns();
  // Before the messages of a new connection: what is known of the daemon before must not mix in.
  take_news(now_ns);
  net::Message topic;
  net::Message body;
  bool more = true;
  for (int i = 0; i < kMessagesAtOnce && more; ++i) {
    more = topic.receive(publish_->get());
    if (!more) break;
    const bool sound = topic.more() && body.receive(publish_->get()) && !body.more();
    while (body.more() && body.receive(publish_->get())) {
    }
    if (!sound) continue;
    heard_ns_ = now_ns;
    if (!hub_.daemon().alive && publish_->monitor().established()) hub_.daemon_is({.alive = true});
    hub_.heard(topic.text(), body.text(), now_ns);
  }
  hub_.flush();
  return !more;
}

bool DaemonLink::hear_replies() {
  net::Message part;
  for (int i = 0; i < kMessagesAtOnce; ++i) {
    if (!part.receive(control_->get())) return true;
    std::uint64_t ticket = 0;
    const bool numbered = part.more() && part.text().size() == sizeof ticket;
    if (numbered) std::memcpy(&ticket, part.text().data(), sizeof ticket);
    bool whole = part.more() && part.receive(control_->get()) && !part.more();
    while (part.more() && part.receive(control_->get())) {
    }
    whole = whole && numbered;
    if (whole && ticket == kStatusTicket) {
      take_status(part.text());
    } else if (whole) {
      hub_.replied(ticket, part.text());
    }
  }
  return false;
}

void DaemonLink::take_news(std::int64_t now_ns) {
  net::LinkMonitor& monitor = publish_->monitor();
  const std::string why =
      net::refusal_words(monitor.next_refusal(), net::Domain::kPublish, options_.server_key);
  const std::string daemon = "the daemon at " + options_.connect;
  if (monitor.ends() != publish_ends_) {
    publish_ends_ = monitor.ends();
    hub_.daemon_is({.alive = false, .sentence = daemon + " has gone; it is tried again"});
    // It may come back with other keys.
    if (control_again_ns_) control_again_ns_ = now_ns;
  }
  if (!why.empty()) {
    hub_.daemon_is({.alive = false, .sentence = daemon + " " + why});
    publish_again_ns_ = now_ns + kPublishAgain_ns;
  }
}

void DaemonLink::check_control(std::int64_t now_ns) {
  net::LinkMonitor& monitor = control_->monitor();
  const std::string why =
      net::refusal_words(monitor.next_refusal(), net::Domain::kControl, options_.server_key);
  const std::string daemon = "the daemon at " + options_.control;
  if (!why.empty()) {
    hub_.control_is({.may = false, .reason = daemon + " " + why});
    control_again_ns_ = now_ns + kControlAgain_ns;
    return;
  }
  const bool anew = monitor.ends() != control_ends_ || !control_stood_;
  control_ends_ = monitor.ends();
  control_stood_ = monitor.established();
  if (!control_stood_) {
    if (!control_again_ns_) {
      hub_.control_is({.may = false,
                       .reason = "nothing answers at " + options_.control +
                                 ", the daemon's control endpoint (--control)"});
    }
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

void DaemonLink::take_status(std::string_view bytes) {
  v1::ControlReply reply;
  if (!reply.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
  asked_ns_.reset();
  hub_.control_is({.may = reply.ok(), .reason = reply.error()});
}

void DaemonLink::connect_anew(std::int64_t now_ns) {
  const auto due = [&](const std::optional<std::int64_t>& again_ns) {
    return again_ns && now_ns >= *again_ns;
  };
  Result<> opened;
  // What fails now (a key file is being replaced, no descriptor is free) is tried again.
  const std::int64_t later_ns = now_ns + kTryAgain_ns;
  if (due(publish_again_ns_)) {
    publish_again_ns_ = later_ns;
    opened = open_publish();
  }
  if (opened && due(control_again_ns_)) {
    control_again_ns_ = later_ns;
    opened = open_control();
  }
  if (!opened) spdlog::error("the bridge cannot connect anew: {}", opened.error().text());
}

void DaemonLink::turn(std::int64_t now_ns) {
  connect_anew(now_ns);
  publish_->turn();
  if (hub_.daemon().alive && now_ns - heard_ns_ > kSilent_ns) {
    hub_.daemon_is({.alive = false,
                    .sentence = "the daemon at " + options_.connect +
                                " has been silent for 3 s: it "
                                "is stopped or stuck"});
  }
  if (!control_) return;
  check_control(now_ns);
  control_->turn();
}

}  // namespace posed::view
