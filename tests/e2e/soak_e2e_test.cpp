// A daemon with 16 streams that is left running and records, with a relay and a page's bridge,
// while a glove is unplugged and plugged in, people come over a bad network, models and parameters
// change, a subscriber stalls and strangers do 400 hostile things a minute: memory, open files and
// latency stay as they were. POSED_SOAK_SECONDS=3600 is the long run, in which an innocent
// subscriber also loses no frame; POSED_SOAK_CSV names a file for a row of figures each second.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/driver.hpp"
#include "drivers/transport/address.hpp"
#include "tests/e2e/served.hpp"
#include "tests/e2e/view_client.hpp"
#include "tests/support/emulated_glove.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/raw_peer.hpp"
#include "tests/support/udp_proxy.hpp"
#include "tests/untrusted/target.hpp"

namespace posed::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

constexpr int kActsASecond = 7;  // 420 a minute

double soak_s() {
  const char* const wanted = std::getenv("POSED_SOAK_SECONDS");
  return wanted == nullptr ? 12.0 : std::atof(wanted);
}

// What one second looked like. `rss_mb` is the daemon's.
struct Second {
  double at_s = 0.0, rss_mb = 0.0, relay_mb = 0.0, bridge_mb = 0.0, cpu_percent = 0.0,
         publish_p50_us = 0.0, publish_p99_us = 0.0;
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
    std::ofstream config(path("posed.toml"), std::ios::app);
    for (int i = 1; i <= 12; ++i) {
      config << "[[stream]]\nname = \"clip" << i
             << "\"\ndriver = \"file\"\n[stream.file]\npath = \"walk.bvh\"\nloop = true\n";
    }
    config << "[[stream]]\nname = \"hand\"\ndriver = \"lucidgloves\"\nport = \"" << path("glove")
           << "\"\nhand = \"right\"\n[stream.generate]\n[[source]]\nname = \"people\"\n"
           << "driver = \"mvn\"\nstreams = \"all\"\n[source.mvn]\nlisten = \"" << listen_ << "\"\n";
  }

  void plug(bool in) {
    if (!in) return glove_.reset();
    glove_.emplace(path("glove"));
  }
  [[nodiscard]] bool plugged() const { return glove_.has_value(); }
  [[nodiscard]] const std::string& people() const { return listen_; }

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

double memory_mb(const Process& process) {
  std::ifstream statm("/proc/" + std::to_string(process.pid()) + "/statm");
  double size = 0.0, resident = 0.0;
  statm >> size >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

std::string garbage(std::mt19937& random, std::size_t most) {
  std::string bytes(random() % most, ' ');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

void send_datagram(const std::string& endpoint, const std::string& bytes) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const auto to = drivers::parse_endpoint(endpoint).value();
  static_cast<void>(::sendto(fd, bytes.data(), bytes.size(), MSG_DONTWAIT, to.get(), to.size));
  ::close(fd);
}

// What strangers do to the ports of the daemon, the relay and the page. None of it takes long.
class Strangers {
 public:
  Strangers(const Soaked& stage, std::string relay, std::string page)
      : stage_(stage), relay_(std::move(relay)), page_(std::move(page)) {}

  void act(std::mt19937& random) {
    const std::array<std::string, 4> ports{stage_.publish, stage_.control, relay_, page_};
    const std::string& port = ports[random() % ports.size()];
    const std::string& zmq_port = ports[random() % 3];
    switch (random() % 10) {
      case 0:
        return say(port, garbage(random, 4096));
      case 1:  // a handshake that stays unfinished for a while
        held_.push_back(std::make_unique<RawPeer>(port));
        static_cast<void>(held_.back()->send(zmtp::greeting().substr(0, random() % 64), kShort));
        if (held_.size() > 20) held_.erase(held_.begin());
        return;
      case 2:
        return shake(zmq_port, "SUB", [&] {
          std::string all;
          for (int i = 0; i < 2000; ++i) all += zmtp::subscribe("pose/" + std::to_string(random()));
          return all;
        });
      case 3:
        return shake(zmq_port, "DEALER", [&] { return zmtp::frame(garbage(random, 200)); });
      case 4:  // parts of a message that does not end
        return shake(zmq_port, "SUB", [&] {
          std::string all;
          for (int i = 0; i < 5000; ++i) all += zmtp::frame("x", 1);
          return all;
        });
      case 5:
        return say(page_, "GET /" + garbage(random, 300) + " HTTP/1.1\r\nHost: x\r\n\r\n");
      case 6:
        return say(page_, "GET /ws?token=" + std::string(32, 'a') +
                              " HTTP/1.1\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\r\n");
      case 7:
        return send_datagram(stage_.people(), garbage(random, 60'000));
      case 8:  // begins as the device's datagrams do
        return send_datagram(stage_.people(), "MXTP02" + garbage(random, 2000));
      default:
        return shake(zmq_port, "SUB",
                     [] { return zmtp::subscribe("") + zmtp::subscribe("skeleton/"); });
    }
  }

 private:
  static constexpr auto kShort = 20ms;

  static void say(const std::string& port, const std::string& bytes) {
    static_cast<void>(RawPeer(port).send(bytes, kShort));
  }
  static void shake(const std::string& port, const char* as,
                    const std::function<std::string()>& then) {
    const RawPeer peer(port);
    if (!peer.send(zmtp::greeting(), kShort) || peer.receive(64, 200ms).size() < 64) return;
    static_cast<void>(peer.send(zmtp::ready(as) + then(), kShort));
  }

  const Soaked& stage_;
  std::string relay_, page_;
  std::vector<std::unique_ptr<RawPeer>> held_;
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
        static_cast<void>(stranger.send(garbage(random, 4096)));
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
  Process relay({"relay", "--from", stage.publish, "--bind", "tcp://127.0.0.1:*"});
  const std::string relayed = json::parse(relay.line().value()).at("publish");
  const ViewProcess view(relayed, stage.control);
  const PageClient page(view);
  Innocent innocent(relayed, "clip12");
  Strangers strangers(stage, relayed, view.host);
  Process stats({"monitor", "--connect", stage.publish, "--topic", "stats", "--json"});
  std::ofstream csv;
  if (const char* const file = std::getenv("POSED_SOAK_CSV")) csv.open(file);
  csv << "s,rss_mb,relay_mb,bridge_mb,files,cpu_percent,publish_p50_us,publish_p99_us\n";
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
    second.relay_mb = memory_mb(relay);
    second.bridge_mb = view.memory_MB();
    csv << second.at_s << ',' << second.rss_mb << ',' << second.relay_mb << ',' << second.bridge_mb
        << ',' << second.files << ',' << second.cpu_percent << ',' << second.publish_p50_us << ','
        << second.publish_p99_us << std::endl;
    trouble(stage, static_cast<int>(seconds.size()), random);
    for (int i = 0; i < kActsASecond; ++i) strangers.act(random);
    seconds.push_back(second);
  }
  CHECK(innocent.receives(10));
  innocent.stop();
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);
  // The first part fills what is of fixed size: rings, caches, the stalled subscriber's queue.
  // On a busy machine memory is still being filled after the short run, and frames are shed.
  const bool is_long = soak_s() > 300.0;
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
  for (const auto memory : {&Second::relay_mb, &Second::bridge_mb}) {
    const double begin_mb = median_of(seconds, half, tail, memory);
    const double end_mb = median_of(seconds, tail, seconds.size(), memory);
    WARN((memory == &Second::relay_mb ? "relay " : "bridge ")
         << begin_mb << " -> " << end_mb << " MB");
    if (is_long) CHECK(end_mb - begin_mb < 1.0);
  }
  WARN("the innocent got " << innocent.frames << " frames, lost " << innocent.lost
                           << ", waited at most " << innocent.longest_s() << " s");
  if (is_long) CHECK(innocent.lost == 0);
  if (is_long) CHECK(after_mb - before_mb < 1.0);
  CHECK(most_files(tail, seconds.size()) <= most_files(half, tail) + 2);
  stage.check_replay();
}

}  // namespace posed::test
