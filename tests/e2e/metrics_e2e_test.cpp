// [metrics] of the real binary: what Prometheus reads is right and agrees with the stats, and
// whatever else comes to its port disturbs no stream.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <random>
#include <regex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/net/peer_guard.hpp"
#include "tests/e2e/metrics_page.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/asked_again.hpp"
#include "tests/support/file_text.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;

constexpr const char* kMetrics = "[metrics]\nlisten = \"127.0.0.1:0\"\n";

// A daemon with metrics, and where they are.
struct Measured : Served {
  explicit Measured(const std::string& tables = kMetrics) : Served(tables) {}
  void start() {
    Served::start();
    find();
  }
  void record() {
    Served::record();
    find();
  }
  std::string metrics;  // URL

 private:
  void find() {
    REQUIRE(daemon->comes_to_say("/metrics"));
    const std::string log = daemon->errors();
    INFO(log);
    const auto at = log.find("http://");
    REQUIRE(at != std::string::npos);
    metrics = log.substr(at, log.find('\n', at) - at);
  }
};

// A number of `posed ctl status --json`, where 64-bit integers are text.
double number_of(const nlohmann::json& value) {
  return value.is_string() ? std::stod(value.get<std::string>()) : value.get<double>();
}

nlohmann::json walker_status(const Stage& stage) {
  return nlohmann::json::parse(stage.ctl({"--json", "status"}).out).at("status").at("stream").at(0);
}

TEST_CASE("metrics grow with the frames, and every count agrees with the status", "[metrics]") {
  Measured served;
  // A clip that ends, so that both are asked about the same moment.
  served.folder.write("posed.toml", std::string(Stage::kEndpoints) + kMetrics + R"(
[[stream]]
name = "walker"
driver = "file"
[stream.file]
path = "walk.bvh"
loop = false
[stream.style]
model = "one.style"
[[output]]
kind = "vmc"
body = "walker"
to = ["127.0.0.1:9"]
)");
  served.start();
  REQUIRE(served.metrics.ends_with("/metrics"));
  const MetricsPage first(served.metrics);
  const auto grows = [&](const MetricsPage& page) {
    return page.value("posed_frames_total").value() > first.value("posed_frames_total").value();
  };
  const auto later = [&] {
    std::this_thread::sleep_for(500ms);
    return MetricsPage(served.metrics);
  };
  const MetricsPage second = asked_again(later, grows);
  CHECK(grows(second));
  for (const auto& [name, family] : second.families) {
    if (family.type == "gauge") continue;
    for (const auto& [sample, series] : family.samples) {
      for (const auto& [labels, value] : series) {
        const auto before = first.value(sample, labels);
        INFO(sample);
        CHECK(value >= before.value_or(0.0));
      }
    }
  }

  const auto end = std::chrono::steady_clock::now() + 20s;
  while (walker_status(served).at("state") != "ended" && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(50ms);
  }
  std::this_thread::sleep_for(200ms);  // what is kept of the page is older than that
  REQUIRE(served.ctl({"set", "nobody", "alpha", "1"}).code == 1);
  const auto status = walker_status(served);
  const MetricsPage page(served.metrics);
  const double frames = number_of(status.at("frames"));
  const double shed = number_of(status.at("shed"));  // by a busy machine
  CHECK(frames + shed == 240);
  const MetricsPage::Labels walker{{"stream", "walker"}};
  CHECK(page.value("posed_frames_total", walker) == frames);
  CHECK(page.value("posed_decoded_frames_total", walker) == frames + shed);
  for (const char* name : {"posed_decode_seconds_count", "posed_latency_seconds_count"}) {
    INFO(name);
    CHECK(
        page.value(name, walker) ==
        frames -
            page.value("posed_frames_total", {{"stream", "walker"}, {"quality", "stale"}}).value());
  }
  CHECK(page.value("posed_stage_seconds_count", {{"stage", "style"}}) == frames);
  CHECK(page.value("posed_latency_seconds_sum", walker).value() > 0.0);
  CHECK(page.value("posed_shed_total", walker) == shed);
  CHECK(page.value("posed_dropped_total", walker) == number_of(status.at("dropped")));
  CHECK(page.value("posed_packets_total", {{"device", "walker"}, {"outcome", "ok"}}) ==
        number_of(status.at("outcome").at(0)));
  CHECK(page.value("posed_stream_state", {{"stream", "walker"}, {"state", "ended"}}) == 1.0);
  CHECK(page.value("posed_stream_state", walker) == 1.0);
  CHECK(page.value("posed_device_up", {{"device", "walker"}, {"driver", "file"}}) == 1.0);
  CHECK(page.value("posed_frame_period_seconds", walker).value() == Approx(1.0 / 120.0));
  CHECK(page.value("posed_output_frames_total", {{"output", "vmc-walker"}}) == frames);
  CHECK(page.value("posed_control_refusals_total") == 1.0);
  CHECK(page.value("posed_control_requests_total").value() >= 3.0);
  CHECK(page.value("posed_recording") == 0.0);
  CHECK_FALSE(page.value("posed_recorder_bytes"));
  CHECK(page.value("posed_build_info") == 1.0);
  CHECK(page.value("process_cpu_seconds_total").value() > 0.0);
  CHECK(page.value("process_resident_memory_bytes").value() > 1e6);
  const double age_s =
      std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count() -
      page.value("process_start_time_seconds").value();
  CHECK(age_s > 1.0);
  CHECK(age_s < 3600.0);
}

TEST_CASE("metrics tell of the recording, its disk and the subscribers", "[metrics]") {
  Measured served;
  served.record();
  Process monitor({"monitor", "--connect", served.publish});
  REQUIRE(monitor.line());
  const MetricsPage page(served.metrics);
  CHECK(page.value("posed_recording") == 1.0);
  CHECK(page.value("posed_recorder_bytes").value() > 1000.0);
  CHECK(page.value("posed_recorder_lost_total") == 0.0);
  CHECK(page.value("posed_recorder_errors_total") == 0.0);
  CHECK(page.value("posed_recorder_last_error_timestamp_seconds") == 0.0);
  CHECK(page.value("posed_recorder_disk_free_bytes").value() > 1e6);
  CHECK(page.value("posed_recorder_disk_size_bytes").value() >
        page.value("posed_recorder_disk_free_bytes").value());
  CHECK(page.value("posed_clients", {{"socket", "publish"}}).value() >= 1.0);
}

TEST_CASE("without the table nothing listens, and the table is for this machine alone",
          "[metrics]") {
  Served served;
  served.start();
  CHECK_FALSE(has(served.daemon->errors(), "metrics"));
  served.write_config("[metrics]\nlisten = \"0.0.0.0:5572\"\n");
  const ProgramOutcome checked = posed({"check", "--config", served.path("posed.toml")});
  CHECK(checked.code == 2);
  CHECK(has(checked.err, "reverse proxy"));
  served.write_config("[metrics]\n");
  CHECK(has(posed({"check", "--config", served.path("posed.toml")}).out,
            "metrics on http://127.0.0.1:5572/metrics"));
}

TEST_CASE("the line of a daemon that is ready has the metrics, and a port that is taken is named",
          "[metrics]") {
  Measured first;
  Process daemon({"run", "--config", first.path("posed.toml")});
  const auto ready = daemon.line();
  REQUIRE(ready);
  first.metrics = nlohmann::json::parse(*ready).at("metrics");
  CHECK(MetricsPage(first.metrics).value("posed_build_info") == 1.0);
  Served second("[metrics]\nlisten = \"" + host_of_url(first.metrics) + "\"\n");
  const ProgramOutcome refused = posed({"run", "--config", second.path("posed.toml")});
  CHECK(refused.code == 1);
  CHECK(has(refused.err, "cannot listen on " + host_of_url(first.metrics)));
  CHECK(has(refused.err, "[metrics]"));
}

// One request after the other on one connection, as Prometheus asks.
TEST_CASE("a reader keeps its connection, and gets nothing for wrong requests", "[metrics]") {
  Measured served;
  served.start();
  const std::string host = host_of_url(served.metrics);
  {
    const RawPeer peer(host);
    for (int i = 0; i < 3; ++i) {
      REQUIRE(peer.send("HEAD /metrics HTTP/1.1\r\nHost: " + host + "\r\n\r\n"));
      std::string head;
      while (!head.ends_with("\r\n\r\n")) {
        const std::string next = peer.receive(1);
        REQUIRE(!next.empty());
        head += next;
      }
      CHECK(http_status(head) == 200);
      CHECK(head.find("# HELP") == std::string::npos);
    }
  }
  const std::string answer = http_answer(served.metrics, "GET /metrics");
  CHECK(has(answer, "X-Content-Type-Options: nosniff"));
  CHECK(has(answer, "Cache-Control: no-store"));
  CHECK(http_status(http_answer(served.metrics, "GET /")) == 404);
  CHECK(http_status(http_answer(served.metrics, "POST /metrics", "Content-Length: 3\r\n")) == 405);
  CHECK(http_status(http_answer(served.metrics, "DELETE /metrics")) == 405);
  // A WebSocket is only for the page of `posed view`.
  CHECK(http_status(http_answer(served.metrics, "GET /metrics",
                                "Upgrade: websocket\r\nConnection: Upgrade\r\n"
                                "Sec-WebSocket-Version: 13\r\n"
                                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n")) != 101);
  const RawPeer stranger(host);
  REQUIRE(stranger.send("GET /metrics HTTP/1.1\r\nHost: evil.example\r\n\r\n"));
  CHECK(http_status(stranger.receive(12)) == 403);
}

TEST_CASE("garbage, slow and many connections at the metrics' port disturb no stream",
          "[metrics]") {
  net::raise_file_limit();  // of this test, which holds some hundred connections
  Measured served;
  served.start();
  const std::string host = host_of_url(served.metrics);
  const auto memory_MB = [&] {
    return MetricsPage(served.metrics).value("process_resident_memory_bytes").value() / 1e6;
  };
  const double before_MB = memory_MB();
  const std::string much(1'000'000, 'x');
  std::mt19937 random(5);
  for (int i = 0; i < 40; ++i) {
    const RawPeer peer(host);
    std::string bytes = "GET /" + much;
    if (i % 4 == 1) bytes = "GET /metrics HTTP/1.1\r\nHost: a\r\nX: " + much;
    if (i % 4 == 2) {
      bytes = "POST /metrics HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999\r\n\r\n" + much;
    }
    if (i % 4 == 3) std::ranges::generate(bytes, [&] { return static_cast<char>(random()); });
    static_cast<void>(peer.send(bytes, 200ms));
    CHECK(peer.hung_up());
  }
  std::vector<RawPeer> slow;
  for (int i = 0; i < 300; ++i) {
    slow.emplace_back(host);
    static_cast<void>(
        slow.back().send("GET /metrics HTTP/1.1\r\nX: " + std::string(4000, 'x'), 10ms));
  }
  // Who asks much and reads nothing.
  for (int i = 0; i < 20; ++i) {
    slow.emplace_back(host);
    for (int k = 0; k < 50; ++k) {
      static_cast<void>(
          slow.back().send("GET /metrics HTTP/1.1\r\nHost: " + host + "\r\n\r\n", 1ms));
    }
  }
  const double grown_MB = memory_MB() - before_MB;  // who comes later is served
  std::printf("attacks on the metrics' port: memory of posed %+.1f MB\n", grown_MB);
  CHECK(grown_MB < 32.0);
  const auto walker = walker_status(served);
  CHECK(walker.at("state") == "live");
  // A busy machine costs some frames without any attack; one that stops the stream costs most.
  CHECK(number_of(walker.at("shed")) + number_of(walker.at("dropped")) <=
        number_of(walker.at("frames")) / 10);
  CHECK_FALSE(served.daemon->exit_code(0ms));
}

// Names of metrics in an example file: all words that begin as ours do.
std::set<std::string> names_in(const std::string& text) {
  static const std::regex kName("\\b(posed|process)_[a-z_]+[a-z]\\b");
  return {std::sregex_token_iterator(text.begin(), text.end(), kName),
          std::sregex_token_iterator()};
}

TEST_CASE("the example dashboard and alerts name metrics that exist", "[metrics]") {
  Measured served;
  served.record();
  std::set<std::string> known;
  const MetricsPage page(served.metrics);
  for (const auto& [name, family] : page.families) {
    known.insert(name);
    for (const auto& [sample, series] : family.samples) known.insert(sample);
  }
  std::set<std::string> used;
  for (const char* name : {"dashboard.json", "alerts.yml"}) {
    const std::string text = file_text(source_dir() / "config/metrics" / name);
    const auto names = names_in(text);
    INFO(name);
    CHECK(names.size() > 5);
    for (const std::string& one : names) {
      INFO(one);
      CHECK(known.contains(one));
    }
    used.insert(names.begin(), names.end());
  }
  CHECK(nlohmann::json::accept(file_text(source_dir() / "config/metrics/dashboard.json")));
  // What an administrator must hear of.
  for (const char* name :
       {"posed_stream_state", "posed_dropped_total", "posed_latency_seconds_bucket",
        "posed_recorder_lost_total", "posed_recorder_disk_free_bytes"}) {
    INFO(name);
    CHECK(used.contains(name));
  }
}

}  // namespace
}  // namespace posed::test
