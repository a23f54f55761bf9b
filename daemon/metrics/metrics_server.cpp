#include "daemon/metrics/metrics_server.hpp"

#include <chrono>
#include <cstring>
#include <thread>
#include <utility>

#include <spdlog/spdlog.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>

#include "daemon/http/server.hpp"
#include "daemon/metrics/text_format.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/system/realtime.hpp"
#include "drivers/transport/address.hpp"

namespace posed::metrics {
namespace {

constexpr std::chrono::nanoseconds kBeatEvery{system::kMaxSleep_ns / 2};

boost::asio::ip::tcp::endpoint endpoint_of(const drivers::Address& address) {
  boost::asio::ip::tcp::endpoint endpoint;
  endpoint.resize(address.size);
  std::memcpy(endpoint.data(), address.get(), address.size);
  return endpoint;
}

}  // namespace

// In the order in which they need each other: connections live in the io_context's handlers and use
// service and connections.
class MetricsServer::Parts {
 public:
  explicit Parts(std::function<Figures()> collect)
      : service_([collect = std::move(collect)] { return metrics_text(collect()); },
                 system::monotonic_ns),
        timer_(io_) {}
  ~Parts() {
    if (!thread_.joinable()) return;
    io_.stop();
    thread_.join();
  }
  Parts(const Parts&) = delete;
  Parts& operator=(const Parts&) = delete;

  Result<> start(const std::string& listen) {
    const auto address = TRY(drivers::parse_endpoint(listen));
    server_ = TRY(http::Server::open(
        io_, connections_,
        {.at = endpoint_of(address),
         .advice = "end the program that has this port, or choose another in [metrics]"}));
    service_.set_hosts(server_->hosts());
    url_ = server_->url() + "metrics";
    spdlog::info("metrics: {}", url_);
    beat();
    thread_ = std::thread([this] {
      system::name_thread(kThreadName);
      io_.run();
    });
    return {};
  }
  [[nodiscard]] const system::Pulse& pulse() const noexcept { return pulse_; }
  [[nodiscard]] const std::string& url() const noexcept { return url_; }

 private:
  void beat() {
    pulse_.beat();
    timer_.expires_after(kBeatEvery);
    timer_.async_wait([this](const boost::system::error_code& error) {
      if (!error) beat();
    });
  }

  system::Pulse pulse_;
  MetricsService service_;
  http::Connections connections_{.service = service_};
  boost::asio::io_context io_{1};
  boost::asio::steady_timer timer_;
  std::unique_ptr<http::Server> server_;
  std::string url_;
  std::thread thread_;
};

Result<std::unique_ptr<MetricsServer>> MetricsServer::start(const std::string& listen,
                                                            std::function<Figures()> collect) {
  auto parts = std::make_unique<Parts>(std::move(collect));
  TRY(parts->start(listen));
  return std::unique_ptr<MetricsServer>(new MetricsServer(std::move(parts)));
}

MetricsServer::MetricsServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
MetricsServer::~MetricsServer() = default;

const system::Pulse& MetricsServer::pulse() const noexcept { return parts_->pulse(); }
const std::string& MetricsServer::url() const noexcept { return parts_->url(); }

http::Answer MetricsService::answer(const http::Request& request) {
  if (!http::is_own_host(request.host, hosts_)) {
    return http::refuse(403, "this name is not the daemon's: ask for 127.0.0.1 and its port\n");
  }
  if (request.method != "GET" && request.method != "HEAD") {
    return http::refuse(405, "only GET and HEAD\n");
  }
  if (request.target.substr(0, request.target.find('?')) != "/metrics") {
    return http::refuse(404, "the metrics are at /metrics\n");
  }
  const auto now = text();
  return {.body = *now, .type = kTextType, .keeps = now};
}

std::shared_ptr<const std::string> MetricsService::text() {
  const std::int64_t now_ns = clock_();
  if (text_ == nullptr || now_ns - made_ns_ >= kKeep_ns) {
    text_ = std::make_shared<const std::string>(make_());
    made_ns_ = now_ns;
  }
  return text_;
}

}  // namespace posed::metrics
