#include "daemon/tools/view/bridge.hpp"

#include <pthread.h>

#include <chrono>
#include <csignal>
#include <thread>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include "daemon/http/server.hpp"
#include "daemon/net/security.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/tools/view/hand_feed.hpp"
#include "proto/frame/time.hpp"
#include "proto/text/clean.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::view {

http::Answer WebRoom::answer(const http::Request& request) {
  const http::Answer answer = answer_to(request, site);
  if (!answer.upgrades() || tabs.size() < kMaxTabs) return answer;
  return http::refuse(503, "too many pages are open: close one\n");
}

void WebRoom::upgrade(boost::beast::tcp_stream stream, const http::Message& request) {
  std::make_shared<TabSession>(std::move(stream), *this)->start(request);
}

void WebRoom::turn(std::int64_t now_ns) {
  for (TabSession* tab : tabs) tab->check(now_ns);
}

namespace {

namespace beast = boost::beast;
namespace websocket = beast::websocket;
using namespace std::chrono_literals;

constexpr std::int64_t kSendWithin_ns = 30 * kNanosPerSecond;

}  // namespace

TabSession::TabSession(beast::tcp_stream stream, WebRoom& room)
    : room_(room),
      place_(room.tabs.insert(room.tabs.end(), this)),
      socket_(std::move(stream)),
      buffer_(kMaxPageMessage) {
  tab_.wake = [this] { send(); };
}

TabSession::~TabSession() {
  room_.hub.leave(tab_);
  room_.tabs.erase(place_);
}

void TabSession::start(const http::Message& request) {
  // A browser answers pings by itself, also while the page's script stands still.
  socket_.set_option(websocket::stream_base::timeout{
      .handshake_timeout = 10s, .idle_timeout = 30s, .keep_alive_pings = true});
  socket_.read_message_max(kMaxPageMessage);
  socket_.auto_fragment(false);
  socket_.async_accept(request, [self = shared_from_this()](const beast::error_code& error) {
    if (error) return;
    self->open_ = true;
    self->room_.hub.join(self->tab_);
    self->read();
  });
}

void TabSession::read() {
  if (reading_ || !open_ || !tab_.outbox.has_room()) return;
  reading_ = true;
  socket_.async_read(
      buffer_, [self = shared_from_this()](const beast::error_code& error, std::size_t) {
        self->reading_ = false;
        if (error || !self->open_) return self->close();
        const auto data = self->buffer_.cdata();
        const std::string_view bytes(static_cast<const char*>(data.data()), data.size());
        self->room_.hub.handle(self->tab_, bytes, self->socket_.got_text(), system::monotonic_ns());
        self->buffer_.clear();
        self->read();
      });
}

void TabSession::send() {
  if (is_sending_ || !open_) return;
  auto parcel = tab_.outbox.next();
  if (!parcel) return;
  sending_ = std::move(*parcel);
  sending_ns_ = system::monotonic_ns();
  is_sending_ = true;
  socket_.text(sending_.text);
  socket_.async_write(boost::asio::buffer(*sending_.bytes),
                      [self = shared_from_this()](const beast::error_code& error, std::size_t) {
                        self->is_sending_ = false;
                        self->sending_ = {};
                        if (error) return self->close();
                        self->send();
                        self->read();  // answers may have room again
                      });
}

void TabSession::check(std::int64_t now_ns) {
  if (is_sending_ && now_ns - sending_ns_ > kSendWithin_ns) close();
}

// Without a farewell: who does not read would not read it either.
void TabSession::close() {
  if (std::exchange(open_, false)) room_.hub.leave(tab_);
  beast::get_lowest_layer(socket_).close();
}

namespace {

constexpr std::chrono::milliseconds kTurnEvery{50};

Result<boost::asio::ip::address> address_of(const std::string& text) {
  boost::system::error_code error;
  auto address = boost::asio::ip::make_address(text == "localhost" ? "127.0.0.1" : text, error);
  if (!error) return address;
  return misuse(in_quotes(text) + " is not an address: --bind takes one such as 127.0.0.1");
}

}  // namespace

Result<bool> is_loopback_address(const std::string& address) {
  const auto parsed = TRY(address_of(address));
  return parsed.is_loopback();
}

// In the order in which they need each other: connections of pages live in the io_context's
// handlers and use hub and room.
class Bridge::Parts {
 public:
  static Result<std::unique_ptr<Parts>> open(const BridgeOptions& options) {
    auto page = TRY(PageFiles::load(options.page));
    auto context = TRY(net::open_context());
    const bool camera = page.has_camera();
    std::unique_ptr<Parts> parts(new Parts(
        std::move(context),
        {.files = std::move(page), .token = options.token.empty() ? random_token() : options.token},
        {.version = POSED_VERSION,
         .connect = options.link.publish.endpoint,
         .same_machine = net::is_loopback(options.link.publish.endpoint),
         .camera = camera}));
    parts->link_ =
        TRY(DaemonLink::open(parts->io_, parts->context_.get(), options.link, parts->hub_));
    const auto address = TRY(address_of(options.address));
    parts->server_ =
        TRY(http::Server::open(parts->io_, parts->connections_,
                               {.at = {address, options.port},
                                .or_any = options.or_any_port,
                                .advice = "choose another port (--port 0: any free one)"}));
    parts->room_.site.hosts = parts->server_->hosts();
    parts->url_ = parts->server_->url() + "?token=" + parts->room_.site.token;
    return parts;
  }
  ~Parts() {
    if (!thread_.joinable()) return;
    io_.stop();
    thread_.join();
  }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  void start() {
    turn();
    // Signals are for the command's own thread.
    sigset_t all;
    sigset_t before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    thread_ = std::thread([this] { io_.run(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    pthread_setname_np(thread_.native_handle(), "posed-view");
  }
  [[nodiscard]] const std::string& url() const noexcept { return url_; }

 private:
  Parts(net::Context context, Site site, Greeting greeting)
      : context_(std::move(context)),
        hub_(
            std::move(greeting),
            [this](std::uint64_t ticket, std::string_view request) {
              return link_->ask(ticket, request);
            },
            [this](std::string_view source, std::string_view json) {
              return hands_.send(source, json);
            }),
        room_(std::move(site), hub_),
        timer_(io_) {}

  void turn() {
    const std::int64_t now_ns = system::monotonic_ns();
    link_->want_streams(hub_.tabs() > 0);
    link_->turn(now_ns);
    hub_.expire(now_ns);
    room_.turn(now_ns);
    timer_.expires_after(kTurnEvery);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) turn();
    });
  }

  net::Context context_;
  HandFeed hands_;
  Hub hub_;
  WebRoom room_;
  http::Connections connections_{.service = room_};
  boost::asio::io_context io_{1};
  boost::asio::steady_timer timer_;
  std::unique_ptr<DaemonLink> link_;
  std::unique_ptr<http::Server> server_;
  std::string url_;
  std::thread thread_;
};

Result<std::unique_ptr<Bridge>> Bridge::start(const BridgeOptions& options) {
  auto parts = TRY(Parts::open(options));
  parts->start();
  return std::unique_ptr<Bridge>(new Bridge(std::move(parts)));
}

Bridge::Bridge(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Bridge::~Bridge() = default;

const std::string& Bridge::url() const noexcept { return parts_->url(); }

}  // namespace posed::view
