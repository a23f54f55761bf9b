// A daemon that is left running and records, while a glove is unplugged and plugged in, people come
// over a bad network, models and parameters change, a subscriber stalls and strangers send garbage:
// its memory, its open files and its latency stay as they were. POSED_SOAK_SECONDS=3600 is the long
// run; POSED_SOAK_CSV names a file for a row of figures each second.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/driver.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/emulated_glove.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/raw_peer.hpp"
#include "tests/support/udp_proxy.hpp"

namespace posed::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

double soak_s() {
  const char* const wanted = std::getenv("POSED_SOAK_SECONDS");
  return wanted == nullptr ? 12.0 : std::atof(wanted);
}

// What one second looked like.
struct Second {
  double at_s = 0.0, rss_mb = 0.0, cpu_percent = 0.0, publish_p50_us = 0.0, publish_p99_us = 0.0;
  std::size_t files = 0;
};

// A daemon with a walker in a style, a glove, and people whom a mocap system sends.
class Soaked : public Served {
 public:
  Soaked() {
    proxy_ = std::make_unique<UdpProxy>(
        listen_, UdpProxy::Faults{.loss = 0.02, .duplicate = 0.02, .jitter = 5ms}, 1);
    people_ = std::make_unique<emulate::EmulatedDevice>(
        drivers::find_driver("mvn")->emulate({}).value(),
        emulate::EmulatedPort::open_udp({proxy_->endpoint()}, {0}).value(), emulate::Motion(),
        emulate::EmulatedDevice::Settings());
    thread_ = std::jthread([this](const std::stop_token& stop) { people_->run(stop); });
    std::ofstream(path("posed.toml"), std::ios::app)
        << "[[stream]]\nname = \"hand\"\ndriver = \"lucidgloves\"\nport = \"" << path("glove")
        << "\"\nhand = \"right\"\n[stream.generate]\n[[source]]\nname = \"people\"\n"
        << "driver = \"mvn\"\nstreams = \"all\"\n[source.mvn]\nlisten = \"" << listen_ << "\"\n";
  }

  void plug(bool in) {
    if (!in) return glove_.reset();
    glove_.emplace(path("glove"));
  }
  [[nodiscard]] bool plugged() const { return glove_.has_value(); }

  // What a new second of `posed monitor --topic stats --json` and the kernel say.
  [[nodiscard]] Second measure(const json& stats) const {
    Second second;
    second.rss_mb = std::stod(stats.at("rssBytes").get<std::string>()) / 1e6;
    second.cpu_percent = stats.at("cpuPercent");
    for (const json& stream : stats.at("stream")) {
      if (stream.at("stream") != "walker" || !stream.contains("publish")) continue;
      second.publish_p50_us = stream.at("publish").at("p50Us");
      second.publish_p99_us = stream.at("publish").at("p99Us");
    }
    const std::filesystem::directory_iterator files("/proc/" + std::to_string(daemon->pid()) +
                                                    "/fd");
    second.files = static_cast<std::size_t>(std::distance(begin(files), end(files)));
    return second;
  }

 private:
  std::string listen_ = "127.0.0.1:" + std::to_string(free_port());
  std::unique_ptr<UdpProxy> proxy_;
  std::unique_ptr<emulate::EmulatedDevice> people_;
  std::jthread thread_;
  std::optional<EmulatedGlove> glove_;
};

// Something happens, each second another thing.
void trouble(Soaked& stage, int second, std::mt19937& random) {
  switch (second % 6) {
    case 0:
      return stage.plug(!stage.plugged());
    case 1:
      static_cast<void>(stage.ctl(
          {"set", "walker", "alpha", std::to_string(static_cast<double>(random() % 200) / 100.0)}));
      return;
    case 2:
      static_cast<void>(stage.ctl({"model", "walker", stage.path("two.style")}));
      return;
    case 3:
      for (const std::string& endpoint : {stage.publish, stage.control}) {
        const RawPeer stranger(endpoint);
        std::string garbage(random() % 4096, ' ');
        for (char& byte : garbage) byte = static_cast<char>(random());
        static_cast<void>(stranger.send(garbage));
      }
      return;
    case 4:
      static_cast<void>(stage.ctl({"model", "walker", stage.path("one.style")}));
      return;
    default:
      static_cast<void>(stage.ctl({"set", "walker", "no_such_parameter", "1"}));
  }
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

double median_of(const std::vector<Second>& seconds, std::size_t from, std::size_t to,
                 double Second::* what) {
  std::vector<double> values;
  for (std::size_t i = from; i < to; ++i) values.push_back(seconds[i].*what);
  return median(std::move(values));
}

}  // namespace

TEST_CASE("a daemon that is left running stays as it was", "[soak]") {
  Soaked stage;
  stage.record();
  // A subscriber that never reads, and one for the figures.
  const RawPeer stalled(stage.publish);
  REQUIRE(stalled.shake_hands("SUB"));
  REQUIRE(stalled.send(zmtp::subscribe("")));
  Process stats({"monitor", "--connect", stage.publish, "--topic", "stats", "--json"});
  std::ofstream csv;
  if (const char* const file = std::getenv("POSED_SOAK_CSV")) csv.open(file);
  csv << "s,rss_mb,files,cpu_percent,publish_p50_us,publish_p99_us\n";
  std::mt19937 random(1);
  std::vector<Second> seconds;
  const auto begin = SteadyClock::now();
  const auto elapsed_s = [&] {
    return std::chrono::duration<double>(SteadyClock::now() - begin).count();
  };
  while (elapsed_s() < soak_s()) {
    const auto line = stats.line();
    REQUIRE(line);
    Second second = stage.measure(json::parse(*line));
    second.at_s = elapsed_s();
    csv << second.at_s << ',' << second.rss_mb << ',' << second.files << ',' << second.cpu_percent
        << ',' << second.publish_p50_us << ',' << second.publish_p99_us << std::endl;
    trouble(stage, static_cast<int>(seconds.size()), random);
    seconds.push_back(second);
  }
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  // The first part fills what is of fixed size: rings, caches, the stalled subscriber's queue.
  const std::size_t half = seconds.size() / 2, tail = seconds.size() - seconds.size() / 4;
  REQUIRE(half > 2);
  const double before_mb = median_of(seconds, half, tail, &Second::rss_mb);
  const double after_mb = median_of(seconds, tail, seconds.size(), &Second::rss_mb);
  const auto most_files = [&](std::size_t from, std::size_t to) {
    return std::ranges::max(std::span(seconds).subspan(from, to - from), {}, &Second::files).files;
  };
  WARN(seconds.size() << " s: memory " << before_mb << " -> " << after_mb << " MB, files "
                      << most_files(half, tail) << " -> " << most_files(tail, seconds.size())
                      << ", publish p99 " << median_of(seconds, half, tail, &Second::publish_p99_us)
                      << " -> " << median_of(seconds, tail, seconds.size(), &Second::publish_p99_us)
                      << " us");
  CHECK(after_mb - before_mb < 1.0);
  CHECK(most_files(tail, seconds.size()) <= most_files(half, tail) + 2);
  const auto replay = posed({"replay", stage.path("take.plog"), "--speed", "max", "--expect"});
  INFO(replay.err);
  CHECK(replay.code == 0);
}

}  // namespace posed::test
