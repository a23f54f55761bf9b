// MetricsServer: serves GET /metrics to Prometheus over HTTP, on loopback, with a cold thread of
// its own. Requests to its port cost nothing but this thread's time.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "daemon/metrics/figures.hpp"
#include "daemon/system/pulse.hpp"
#include "proto/frame/result.hpp"

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

}  // namespace posed::metrics
