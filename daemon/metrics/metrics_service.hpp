// MetricsService: answers the requests for metrics. It has neither a socket nor a clock of its own.
// One thread. Cold.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "daemon/http/exchange.hpp"
#include "daemon/http/service.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/time.hpp"

namespace posed::metrics {

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
