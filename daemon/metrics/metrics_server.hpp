// MetricsServer: serves GET /metrics to Prometheus over HTTP, on loopback, with a cold thread of
// its own. Requests to its port cost nothing but this thread's time.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "daemon/http/exchange.hpp"
#include "daemon/http/service.hpp"
#include "daemon/metrics/figures.hpp"
#include "daemon/system/pulse.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::metrics {

class MetricsServer {
 public:
  static constexpr const char* kThreadName = "posed-metrics";

  // Starts the thread, which calls `collect` at most ten times a second. `listen` is an address and
  // a port; for port 0 the system chooses one. Everything that `collect` uses must outlive the
  // server.
  static Result<std::unique_ptr<MetricsServer>> start(const std::string& listen,
                                                      std::function<Figures()> collect);
  ~MetricsServer();  // joins the thread
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  // Any thread.
  [[nodiscard]] const system::Pulse& pulse() const noexcept;
  // "http://127.0.0.1:5572/metrics"
  [[nodiscard]] const std::string& url() const noexcept;

 private:
  class Parts;
  explicit MetricsServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

// Answers the requests for metrics. It has neither a socket nor a clock of its own. One thread.
// Cold.
class MetricsService final : public http::Service {
 public:
  // `make` makes the text; it is called at most once per kKeep_ns, however many clients ask.
  static constexpr std::int64_t kKeep_ns = kNanosPerSecond / 10;
  MetricsService(std::function<std::string()> make, Clock clock)
      : make_(std::move(make)), clock_(clock) {}

  [[nodiscard]] http::Answer answer(const http::Request& request) override;
  // Sets the server's own Host headers; without them every Host header is answered.
  void set_hosts(std::vector<std::string> hosts) { hosts_ = std::move(hosts); }

 private:
  [[nodiscard]] std::shared_ptr<const std::string> text();

  std::function<std::string()> make_;
  Clock clock_;
  std::vector<std::string> hosts_;
  std::shared_ptr<const std::string> text_;  // null: none yet
  std::int64_t made_ns_ = kNoTime_ns;
};

}  // namespace posed::metrics
