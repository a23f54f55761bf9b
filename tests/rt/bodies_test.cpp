// The real-time contract on the daemon's own threads, while bodies come, go and change.
#include <atomic>
#include <chrono>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/config/config.hpp"
#include "tests/rt/check_no_breach.hpp"
#include "tests/rt/contract.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/mocap_room.hpp"

namespace posed::rt {

TEST_CASE("bodies come, go and change within the real-time contract", "[rt]") {
  using namespace std::chrono_literals;
  watch_log();
  const std::uint16_t port = test::free_port();
  const std::string text =
      "[publish]\nendpoint = \"tcp://127.0.0.1:*\"\n[control]\nendpoint = \"tcp://127.0.0.1:*\"\n"
      "[[source]]\nname = \"room\"\ndriver = \"template_mocap\"\nstreams = \"all\"\n"
      "[source.template_mocap]\nlisten = \"127.0.0.1:" +
      std::to_string(port) + "\"\n";
  config::Reading reading = config::read_config(text, "room.toml", drivers::registry());
  REQUIRE(reading.errors.empty());
  reading.config.realtime = false;
  auto daemon = assembly::Daemon::open(reading.config);
  REQUIRE(daemon);
  std::atomic<int> watched{0};
  assembly::DaemonHooks hooks;
  hooks.hot_thread = [&](const char*) {
    if (watch_system_calls()) ++watched;
  };
  forget_breaches();
  REQUIRE((*daemon)->start(std::move(hooks)));
  test::MocapRoom room(port);
  for (int frame = 0; frame < 300; ++frame) {
    if (frame % 55 == 0) room.change();
    room.frame();
    std::this_thread::sleep_for(10ms);
  }
  const v1::Stats stats = (*daemon)->stats();
  (*daemon)->stop();
  CHECK(stats.stream_size() >= 2);
  if (watched != 2) WARN("SKIPPED: this kernel has no syscall user dispatch");
  check_no_breach();
}

}  // namespace posed::rt
