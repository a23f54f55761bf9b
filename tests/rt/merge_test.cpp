// The real-time contract on the daemon's own threads, while the hands of two gloves are put on a
// body.
#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/config/config.hpp"
#include "models/motion/synthetic_walker.hpp"
#include "proto/clip/clip.hpp"
#include "tests/rt/check_no_breach.hpp"
#include "tests/rt/contract.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::rt {

TEST_CASE("hands are merged with a body within the real-time contract", "[rt]") {
  using namespace std::chrono_literals;
  watch_log();
  const test::TempFolder folder;
  const auto walk = motion::make_walker({.seconds = 4.0}).value();
  REQUIRE(clip::write_bvh(walk, folder.path() / "walk.bvh"));
  std::string text =
      "[publish]\nendpoint = \"tcp://127.0.0.1:*\"\n[control]\nendpoint = \"tcp://127.0.0.1:*\"\n"
      "[[stream]]\nname = \"body\"\ndriver = \"file\"\n[stream.file]\npath = \"walk.bvh\"\n"
      "[stream.merge]\nleft = \"glove-l\"\nright = \"glove-r\"\n";
  for (const char* hand : {"left", "right"}) {
    text += std::string("[[stream]]\nname = \"glove-") + hand[0] +
            "\"\ndriver = \"labels\"\n[stream.labels]\nside = \"" + hand + "\"\nrate_hz = 100.0\n";
  }
  config::Reading reading =
      config::read_config(text, folder.path() / "merge.toml", drivers::registry());
  for (const Error& error : reading.errors) FAIL_CHECK(error.text());
  reading.config.realtime = false;
  auto daemon = assembly::Daemon::open(reading.config);
  if (!daemon) FAIL(daemon.error().text());
  std::atomic<int> watched{0};
  assembly::DaemonHooks hooks;
  hooks.hot_thread = [&](const char*) {
    if (watch_system_calls()) ++watched;
  };
  forget_breaches();
  REQUIRE((*daemon)->start(std::move(hooks)));
  // Two seconds of frames at 30 Hz, however long a busy machine needs for them.
  constexpr std::uint64_t kEnough = 60;
  v1::Stats stats;
  for (int i = 0; i < 600; ++i) {
    stats = (*daemon)->stats();
    if (stats.stream_size() == 3 && stats.stream(0).frames() >= kEnough) break;
    std::this_thread::sleep_for(100ms);
  }
  (*daemon)->stop();
  REQUIRE(stats.stream_size() == 3);
  CHECK(stats.stream(0).frames() >= kEnough);
  if (watched != 2) WARN("SKIPPED: this kernel has no syscall user dispatch");
  check_no_breach();
}

}  // namespace posed::rt
