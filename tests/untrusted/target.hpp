// A daemon under attack: one stream at 30 Hz, its memory use as reported by the kernel, and an
// innocent subscriber that counts lost frames and the longest wait.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <fstream>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include "posed/v1/posed.pb.h"
#include "proto/clip/clip.hpp"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/e2e/stage.hpp"
#include "tests/support/raw_peer.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace posed::test {

// Limits for an attack: memory growth in MB, and the longest pause of an innocent subscriber's
// stream.
inline constexpr double kMaxGrowth_MB = 64.0;
inline constexpr double kMaxWait_s = 0.3;

class Target : public Stage {
 public:
  explicit Target(const std::string& security = "") {
    REQUIRE(clip::write_bvh(toy_walk(60, 30.0), folder.path() / "walk.bvh"));
    folder.write("posed.toml", kEndpoints + security +
                                   "[[stream]]\nname = \"walker\"\ndriver = \"file\"\n"
                                   "[stream.file]\npath = \"walk.bvh\"\nloop = true\n");
  }

  void start() {
    launch("run");
    at_start_MB = memory_MB();
  }
  [[nodiscard]] double memory_MB() const {
    std::ifstream statm("/proc/" + std::to_string(daemon->pid()) + "/statm");
    double size = 0.0;
    double resident = 0.0;
    statm >> size >> resident;
    return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
  }
  // Runs `work` until `seconds` have passed or it returns that it is done. Returns the largest
  // memory growth seen.
  template <typename Work>
  double growth_MB(double seconds, Work&& work) const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    double most = 0.0;
    while (std::chrono::steady_clock::now() < end && work()) {
      most = std::max(most, memory_MB() - at_start_MB);
    }
    return std::max(most, memory_MB() - at_start_MB);
  }

  double at_start_MB = 0.0;
};

// Subscribes to a stream's poses on its own thread.
class Innocent {
 public:
  explicit Innocent(const std::string& endpoint, const std::string& stream = "walker")
      : socket_(*net::open_socket(context_.get(), ZMQ_SUB)) {
    REQUIRE(net::set_option(socket_.get(), ZMQ_SUBSCRIBE, "pose/" + stream));
    REQUIRE(net::set_option(socket_.get(), ZMQ_RCVTIMEO, 20));
    REQUIRE(net::connect_socket(socket_.get(), endpoint));
    thread_ = std::thread([this] { listen(); });
    REQUIRE(receives(10));
    longest_ns = 0;
  }
  ~Innocent() { stop(); }
  // Waits until `more` further frames arrive; returns false when they do not.
  bool receives(std::uint64_t more) const {
    const std::uint64_t wanted = frames + more;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (frames < wanted && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return frames >= wanted;
  }
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] double longest_s() const { return static_cast<double>(longest_ns) * 1e-9; }

  std::atomic<std::uint64_t> frames{0}, lost{0};
  std::atomic<std::int64_t> longest_ns{0};

 private:
  void listen() {
    std::uint64_t last = 0;
    auto last_time = std::chrono::steady_clock::now();
    while (!stop_) {
      net::Message topic;
      net::Message body;
      if (!topic.receive(socket_.get(), 0) || !body.receive(socket_.get(), 0)) continue;
      v1::Frame frame;
      if (!frame.ParseFromString(std::string(body.text()))) continue;
      const auto now = std::chrono::steady_clock::now();
      if (last != 0 && frame.sequence() > last + 1) lost += frame.sequence() - last - 1;
      last = frame.sequence();
      const std::int64_t wait_ns =
          std::chrono::duration_cast<std::chrono::nanoseconds>(now - last_time).count();
      longest_ns = std::max<std::int64_t>(longest_ns, wait_ns);
      last_time = now;
      ++frames;
    }
  }

  net::Context context_ = *net::open_context();
  net::Socket socket_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace posed::test
