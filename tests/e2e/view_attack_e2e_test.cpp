// What strangers and broken pages can do to `posed view`, and what pages cost the daemon.
#include <catch2/catch.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "daemon/net/peer_guard.hpp"
#include "posed/v1/posed.pb.h"
#include "tests/e2e/served.hpp"
#include "tests/e2e/view_client.hpp"
#include "tests/support/asked_again.hpp"

namespace posed::test {
namespace {

using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

constexpr double kMaxViewGrowth_MB = 32.0;

v1::ControlRequest status_request() {
  v1::ControlRequest request;
  request.mutable_status();
  return request;
}

// Whether a page that behaves gets poses now.
bool gets_poses(PageClient& page, int count) {
  for (int i = 0; i < count; ++i) {
    page.ready();
    if (!page.next_of("pose/walker")) return false;
  }
  return true;
}

// A daemon, its bridge and an honest page, before and after an attack.
struct UnderAttack {
  UnderAttack() {
    net::raise_file_limit();  // of this test, which holds a thousand connections
    served.start();
    view.emplace(served.publish, served.control);
    honest.emplace(*view);
    REQUIRE(gets_poses(*honest, 20));
    before_MB = view->memory_MB();
  }
  void check(const char* what) {
    const double growth_MB = view->memory_MB() - before_MB;
    std::printf("%s: memory of posed view %+.1f MB\n", what, growth_MB);
    CHECK(growth_MB < kMaxViewGrowth_MB);
    CHECK_FALSE(view->process->exit_code(0ms));
    PageClient late(*view);
    CHECK(late.is_open());
    CHECK(gets_poses(late, 5));
    honest->ask(1, status_request());
    const auto reply = honest->reply(1);
    REQUIRE(reply);
    // A busy machine costs some frames without any attack; one that stops the stream costs most.
    const auto& walker = reply->status().stream(0);
    CHECK(walker.shed() + walker.dropped() <= walker.frames() / 10);
    CHECK(gets_poses(*honest, 20));
  }

  Served served;
  std::optional<ViewProcess> view;
  std::optional<PageClient> honest;
  double before_MB = 0.0;
};

TEST_CASE("a thousand connections keep no page out and do not fill the memory", "[view]") {
  UnderAttack attack;
  std::vector<RawPeer> peers;
  const std::string half = "GET / HTTP/1.1\r\nX: " + std::string(4000, 'x');
  for (int i = 0; i < 1000; ++i) {
    peers.emplace_back(attack.view->host);
    static_cast<void>(peers.back().send(half, 10ms));
    if (i % 100 == 50) CHECK(gets_poses(*attack.honest, 1));
  }
  attack.check("1,000 half requests");
  const auto left = asked_again(
      [&] {
        return std::ranges::count_if(peers, [](const RawPeer& one) { return !one.hung_up(1ms); });
      },
      [](auto count) { return count <= 64; });
  CHECK(left <= 64);
}

TEST_CASE("headers, bodies and bytes without end are cut", "[view]") {
  UnderAttack attack;
  const std::string much(1'000'000, 'x');
  std::mt19937 random(3);
  for (int i = 0; i < 60; ++i) {
    const RawPeer peer(attack.view->host);
    std::string bytes = "GET /" + much;
    if (i % 4 == 1) bytes = "GET / HTTP/1.1\r\nHost: a\r\nX: " + much;
    if (i % 4 == 2) bytes = "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999\r\n\r\n" + much;
    if (i % 4 == 3) std::ranges::generate(bytes, [&] { return static_cast<char>(random()); });
    static_cast<void>(peer.send(bytes, 200ms));
    CHECK(peer.hung_up());
  }
  attack.check("bytes without end");
}

TEST_CASE("huge and broken WebSocket frames end their own connection alone", "[view]") {
  UnderAttack attack;
  std::mt19937 random(4);
  const std::string much(300'000, 'x');
  for (int i = 0; i < 60; ++i) {
    PageClient page(*attack.view);
    REQUIRE(page.is_open());
    switch (i % 6) {
      case 0:  // a frame of 4 EiB
        page.write_raw(std::string("\x82\xff\x40\0\0\0\0\0\0\0mask", 14) + much);
        break;
      case 1:  // one that is just too large
        page.write(much, false);
        break;
      case 2:  // without a mask
        page.write_raw(std::string("\x82\x05hello", 7));
        break;
      case 3:  // a reserved opcode
        page.write_raw(std::string("\x8f\x80mask", 6));
        break;
      case 4: {  // pieces without end
        std::string pieces("\x02\x80mask", 6);
        for (int k = 0; k < 20'000; ++k) pieces += std::string("\x00\x84maskxxxx", 10);
        page.write_raw(pieces);
        break;
      }
      default: {
        std::string noise(4096, '\0');
        std::ranges::generate(noise, [&] { return static_cast<char>(random()); });
        page.write_raw(noise);
      }
    }
    while (page.next(5s)) {
    }
    CHECK_FALSE(page.is_open());
  }
  attack.check("huge and broken frames");
}

TEST_CASE("pages that read nothing cost a fixed amount, whatever they ask for", "[view]") {
  UnderAttack attack;
  std::vector<std::unique_ptr<RawPeer>> deaf;
  std::string asked;  // ready, clock and status, as frames with a mask of zeros
  const auto frame = [](char opcode, const std::string& text) {
    return std::string(1, opcode) + static_cast<char>(0x80 | text.size()) + std::string(4, '\0') +
           text;
  };
  for (std::uint32_t n = 0; n < 100; ++n) {
    asked += frame('\x81', R"({"type":"ready"})");
    asked += frame('\x81', R"({"type":"clock","t0":1})");
    asked += frame('\x82', std::string("\1\0\0\0", 4) + status_request().SerializeAsString());
  }
  for (int i = 0; i < 20; ++i) {
    deaf.push_back(std::make_unique<RawPeer>(attack.view->host));
    REQUIRE(deaf.back()->send("GET /ws?token=" + attack.view->token + " HTTP/1.1\r\nHost: " +
                              attack.view->host + "\r\nOrigin: http://" + attack.view->host +
                              "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                              "Sec-WebSocket-Version: 13\r\n"
                              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"));
    CHECK(deaf.back()->receive(12) == "HTTP/1.1 101");
  }
  const auto end = SteadyClock::now() + 4s;
  double most_MB = 0.0;
  while (SteadyClock::now() < end) {
    for (const auto& peer : deaf) static_cast<void>(peer->send(asked, 1ms));
    REQUIRE(gets_poses(*attack.honest, 1));
    most_MB = std::max(most_MB, attack.view->memory_MB() - attack.before_MB);
  }
  CHECK(most_MB < kMaxViewGrowth_MB);
  attack.check("20 pages that read nothing");
}

// Six walkers at 120 Hz; the figures are in PROOFS.md. Run by name.
TEST_CASE("what pages cost the daemon", "[.][view][cost]") {
  Stage stage;
  REQUIRE(clip::write_bvh(toy_walk(240, 120.0), stage.folder.path() / "walk.bvh"));
  std::string config = Stage::kEndpoints;
  for (int i = 0; i < 6; ++i) {
    config += "[[stream]]\nname = \"w" + std::to_string(i) +
              "\"\ndriver = \"file\"\n[stream.file]\npath = \"walk.bvh\"\nloop = true\n";
  }
  stage.folder.write("posed.toml", config);
  stage.launch("run");
  const auto percent_of = [&](int pages, bool one_stands_still) {
    std::optional<ViewProcess> view;
    if (pages > 0) view.emplace(stage.publish, stage.control);
    std::atomic<bool> stop{false};
    std::vector<std::thread> threads;
    for (int i = 0; i < pages; ++i) {
      threads.emplace_back([&, i] {
        PageClient page(*view);
        while (!stop) {  // 60 animation frames a second
          if (i == 0 && one_stands_still) {
            std::this_thread::sleep_for(16ms);
            continue;
          }
          page.ready();
          while (page.next(16ms)) {
          }
        }
      });
    }
    std::this_thread::sleep_for(2s);
    const double before_s = stage.daemon->cpu_s();
    const auto start = SteadyClock::now();
    std::this_thread::sleep_for(10s);
    const std::chrono::duration<double> passed = SteadyClock::now() - start;
    const double percent = 100.0 * (stage.daemon->cpu_s() - before_s) / passed.count();
    stop = true;
    for (std::thread& thread : threads) thread.join();
    return percent;
  };
  for (int turn = 0; turn < 3; ++turn) {
    const double none = percent_of(0, false);
    const double one = percent_of(1, false);
    const double three = percent_of(3, true);
    std::printf("daemon: CPU %.2f %% without a page, %.2f %% with one, %.2f %% with three\n", none,
                one, three);
  }
  const auto reply = nlohmann::json::parse(stage.ctl({"--json", "status"}).out);
  for (const auto& stream : reply.at("status").at("stream")) {
    std::printf("%s: %.1f frames/s, shed %s, dropped %s\n",
                stream.at("stream").get<std::string>().c_str(), stream.at("rateHz").get<double>(),
                stream.at("shed").get<std::string>().c_str(),
                stream.at("dropped").get<std::string>().c_str());
    CHECK(stream.at("shed") == "0");
    CHECK(stream.at("dropped") == "0");
  }
}

}  // namespace
}  // namespace posed::test
