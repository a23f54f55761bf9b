#include "daemon/view/bridge.hpp"

#include <chrono>
#include <csignal>
#include <optional>
#include <thread>
#include <utility>

#include <pthread.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>

#include "daemon/net/security.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/view/hub.hpp"
#include "daemon/view/web_server.hpp"
#include "proto/zmq/zmq_handle.hpp"

namespace posed::view {
namespace {

constexpr std::chrono::milliseconds kTurnEvery{50};

}  // namespace

// In the order in which they need each other: connections of pages live in the io_context's
// handlers and use hub and room.
class Bridge::Parts {
 public:
  static Result<std::unique_ptr<Parts>> open(const BridgeOptions& options) {
    auto page = PageFiles::load(options.page);
    if (!page) return std::unexpected(page.error());
    auto context = net::open_context();
    if (!context) return std::unexpected(context.error());
    std::unique_ptr<Parts> parts(
        new Parts(std::move(*context), {.files = std::move(*page), .token = random_token()},
                  {.version = POSED_VERSION,
                   .connect = options.link.connect,
                   .same_machine = net::is_loopback(options.link.connect)}));
    auto link = DaemonLink::open(parts->io_, parts->context_.get(), options.link, parts->hub_);
    if (!link) return std::unexpected(link.error());
    parts->link_ = std::move(*link);
    auto server = WebServer::open(
        parts->io_, parts->room_,
        {.address = options.address, .port = options.port, .or_any = options.or_any_port});
    if (!server) return std::unexpected(server.error());
    parts->server_ = std::move(*server);
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
  [[nodiscard]] const WebServer& server() const noexcept { return *server_; }

 private:
  Parts(net::Context context, Site site, Greeting greeting)
      : context_(std::move(context)),
        hub_(std::move(greeting),
             [this](std::uint64_t ticket, std::string_view request) {
               return link_->ask(ticket, request);
             }),
        room_{.site = std::move(site), .hub = hub_},
        timer_(io_) {}

  void turn() {
    const std::int64_t now_ns = system::monotonic_ns();
    link_->want_streams(hub_.tabs() > 0);
    link_->turn(now_ns);
    hub_.expire(now_ns);
    server_->turn(now_ns);
    timer_.expires_after(kTurnEvery);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) turn();
    });
  }

  net::Context context_;
  Hub hub_;
  WebRoom room_;
  boost::asio::io_context io_{1};
  boost::asio::steady_timer timer_;
  std::unique_ptr<DaemonLink> link_;
  std::unique_ptr<WebServer> server_;
  std::thread thread_;
};

Result<std::unique_ptr<Bridge>> Bridge::start(const BridgeOptions& options) {
  auto parts = Parts::open(options);
  if (!parts) return std::unexpected(parts.error());
  (*parts)->start();
  return std::unique_ptr<Bridge>(new Bridge(std::move(*parts)));
}

Bridge::Bridge(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Bridge::~Bridge() = default;

const std::string& Bridge::url() const noexcept { return parts_->server().url(); }
std::uint16_t Bridge::port() const noexcept { return parts_->server().port(); }

}  // namespace posed::view
