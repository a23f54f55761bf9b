// Every mocap system over UDP through a bad network: 5 % of the datagrams are lost, all are late by
// up to 20 ms and so out of order, some come twice, and for three seconds nothing comes. What posed
// publishes is in order, says when it is old, and goes on within a second.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <map>
#include <memory>
#include <thread>

#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/driver.hpp"
#include "proto/frame/time.hpp"
#include "tests/e2e/logged_frames.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/support/asked_again.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/udp_proxy.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;

constexpr UdpProxy::Faults kBadNetwork{.loss = 0.05, .duplicate = 0.03, .jitter = 20ms};

std::int64_t mono_ns() { return std::chrono::steady_clock::now().time_since_epoch() / 1ns; }

std::string port_here() { return "127.0.0.1:" + std::to_string(free_port()); }

// An emulated system behind a bad network.
class FarSystem {
 public:
  FarSystem(const std::string& driver, unsigned seed) : driver_(driver) {
    proxy_ = std::make_unique<UdpProxy>(listen_, kBadNetwork, seed);
    std::vector<std::string> to{proxy_->endpoint()};
    std::vector<std::uint16_t> ports{0};
    if (driver == "natnet") {  // its command socket does not go through the proxy
      to.insert(to.begin(), command_listen_);
      ports.insert(ports.begin(), server_port_);
    }
    drivers::Options options;
    if (driver == "axis") options["link"] = std::string("udp");
    device_ = std::make_unique<emulate::EmulatedDevice>(
        drivers::find_driver(driver)->emulate(options).value(),
        emulate::EmulatedPort::open_udp(to, ports).value(), emulate::Motion(),
        emulate::EmulatedDevice::Settings());
    thread_ = std::jthread([this](const std::stop_token& stop) { device_->run(stop); });
  }

  [[nodiscard]] const std::string& driver() const { return driver_; }
  [[nodiscard]] UdpProxy& proxy() const { return *proxy_; }
  [[nodiscard]] std::string config() const {
    std::string text = "[[source]]\nname = \"" + driver_ + "\"\ndriver = \"" + driver_ +
                       "\"\nstreams = \"all\"\n[source." + driver_ + "]\nlisten = \"" + listen_ +
                       "\"\n";
    if (driver_ == "natnet") {
      text += "unicast = true\nserver = \"127.0.0.1:" + std::to_string(server_port_) +
              "\"\ncommand_listen = \"" + command_listen_ + "\"\n";
    }
    if (driver_ == "axis") text += "link = \"udp\"\n";
    return text;
  }

 private:
  std::string driver_;
  std::string listen_ = port_here(), command_listen_ = port_here();
  std::uint16_t server_port_ = free_port();
  std::unique_ptr<UdpProxy> proxy_;
  std::unique_ptr<emulate::EmulatedDevice> device_;
  std::jthread thread_;
};

// What the log says that was published of one stream.
struct Published {
  std::vector<v1::Frame> frames;

  // By arrival; a stale frame has that of the last pose.
  [[nodiscard]] std::size_t count(std::int64_t from_ns, std::int64_t to_ns,
                                  v1::Quality quality) const {
    return static_cast<std::size_t>(std::ranges::count_if(frames, [&](const v1::Frame& frame) {
      return frame.arrival_ns() >= from_ns && frame.arrival_ns() < to_ns &&
             frame.quality() == quality;
    }));
  }
};

std::map<std::string, Published> published_streams(const std::string& log) {
  std::map<std::string, Published> streams;
  auto reader = log::Reader::open(log);
  REQUIRE(reader);
  for (const log::StreamRow& row : reader->streams()) {
    auto& frames = streams[row.name].frames;
    check_frames_follow(log, row.name, [&](const v1::Frame& frame) { frames.push_back(frame); });
  }
  return streams;
}

void check_order(const Published& stream) {
  std::int64_t device_ns = -1, arrival_ns = 0;
  for (const v1::Frame& frame : stream.frames) {
    if (frame.quality() == v1::QUALITY_STALE) continue;
    CHECK(frame.arrival_ns() >= arrival_ns);
    arrival_ns = frame.arrival_ns();
    if (!frame.has_device_ns()) continue;
    CHECK(frame.device_ns() >= device_ns);  // equal where the datagram with the time was lost
    device_ns = frame.device_ns();
  }
}

// How one body's stream lived through the cut.
struct Survival {
  std::string body;
  std::size_t before = 0, in_the_cut = 0, stale = 0, at_once = 0, after = 0;  // frames

  [[nodiscard]] bool good() const {
    return before > 50 && in_the_cut == 0 && stale >= 1 && at_once > 0 && after > 20;
  }
};

// Cuts seven systems off for three seconds.
std::vector<Survival> survivals() {
  std::vector<std::unique_ptr<FarSystem>> systems;
  Stage stage;
  std::string config = Stage::kEndpoints;
  for (const char* driver :
       {"natnet", "mvn", "vmc", "axis", "rokoko", "mocopi", "template_mocap"}) {
    systems.push_back(
        std::make_unique<FarSystem>(driver, static_cast<unsigned>(systems.size()) + 1));
    config += systems.back()->config();
  }
  stage.folder.write("posed.toml", config);
  stage.record();
  std::this_thread::sleep_for(3s);
  for (const auto& system : systems) system->proxy().cut(true);
  const std::int64_t cut_ns = mono_ns();
  std::this_thread::sleep_for(3s);
  const std::int64_t back_ns = mono_ns();
  for (const auto& system : systems) system->proxy().cut(false);
  std::this_thread::sleep_for(2s);
  const std::int64_t end_ns = mono_ns();
  stage.daemon->send(SIGTERM);
  CHECK(stage.daemon->exit_code() == 0);

  std::vector<Survival> all;
  const auto streams = published_streams(stage.path("take.plog"));
  for (const auto& system : systems) {
    std::size_t bodies = 0;
    for (const auto& [name, stream] : streams) {
      if (!name.starts_with(system->driver() + "-")) continue;
      ++bodies;
      INFO(name);
      check_order(stream);
      const auto measured = [&](std::int64_t from_ns, std::int64_t to_ns) {
        return stream.count(from_ns, to_ns, v1::QUALITY_MEASURED);
      };
      all.push_back({.body = name,
                     .before = measured(0, cut_ns),
                     .in_the_cut = measured(cut_ns + kNanosPerSecond, back_ns),
                     .stale = stream.count(cut_ns - kNanosPerSecond, back_ns, v1::QUALITY_STALE),
                     .at_once = measured(back_ns, back_ns + kNanosPerSecond),
                     .after = measured(back_ns + kNanosPerSecond, end_ns)});
    }
    INFO(system->driver());
    CHECK(bodies > 0);
  }
  return all;
}

}  // namespace

TEST_CASE("mocap systems behind a bad network: output in order, stale when cut, back in a second") {
  const auto all = asked_again(
      survivals, [](const auto& each) { return std::ranges::all_of(each, &Survival::good); });
  for (const Survival& one : all) {
    INFO(one.body << ": " << one.before << " frames before the cut, " << one.in_the_cut
                  << " in it, " << one.stale << " stale, " << one.at_once
                  << " in the second after it, " << one.after << " later");
    CHECK(one.good());
  }
}

}  // namespace posed::test
