#include "daemon/metrics/metrics_service.hpp"

#include "daemon/metrics/text_format.hpp"

namespace posed::metrics {

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
