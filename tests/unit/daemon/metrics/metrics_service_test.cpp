// What the metrics' HTTP server answers, and how often it looks at the daemon.
#include "daemon/metrics/metrics_server.hpp"

#include <string>

#include <catch2/catch.hpp>

namespace posed::metrics {
namespace {

std::int64_t now_in_test_ns = 0;

struct ServiceRig {
  ServiceRig() { service.set_hosts({"127.0.0.1:5572", "localhost:5572"}); }
  [[nodiscard]] http::Answer get(std::string_view target, std::string_view method = "GET",
                                 std::string_view host = "127.0.0.1:5572") {
    return service.answer({.method = method, .target = target, .host = host});
  }
  int made = 0;
  MetricsService service{[this] { return "made " + std::to_string(++made); },
                         []() noexcept { return now_in_test_ns; }};
};

TEST_CASE("metrics are at one place, for readers that ask for this machine") {
  ServiceRig rig;
  const http::Answer answer = rig.get("/metrics");
  CHECK(answer.status == 200);
  CHECK(answer.body == "made 1");
  CHECK(answer.type == "text/plain; version=0.0.4; charset=utf-8");
  CHECK(rig.get("/metrics?x=1", "HEAD", "localhost:5572").status == 200);
  for (const char* target : {"/", "/metrics/", "/metrics2", "//metrics", "metrics", "", "*"}) {
    INFO(target);
    CHECK(rig.get(target).status == 404);
  }
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "get", ""}) {
    INFO(method);
    CHECK(rig.get("/metrics", method).status == 405);
  }
  // A page of the network whose name somebody points at 127.0.0.1 cannot read them.
  for (const char* host : {"evil.example:5572", "127.0.0.1:80", "127.0.0.1", "", "a\"b"}) {
    INFO(host);
    CHECK(rig.get("/metrics", "GET", host).status == 403);
  }
}

TEST_CASE("however often somebody asks, the daemon is looked at ten times a second") {
  ServiceRig rig;
  now_in_test_ns = 5 * kNanosPerSecond;
  const http::Answer first = rig.get("/metrics");
  now_in_test_ns += MetricsService::kKeep_ns - 1;
  for (int i = 0; i < 1000; ++i) static_cast<void>(rig.get("/metrics"));
  CHECK(rig.get("/metrics").body == "made 1");
  ++now_in_test_ns;
  CHECK(rig.get("/metrics").body == "made 2");
  CHECK(rig.made == 2);
  CHECK(first.body == "made 1");  // is still being sent
}

}  // namespace
}  // namespace posed::metrics
