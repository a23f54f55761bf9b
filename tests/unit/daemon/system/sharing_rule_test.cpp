#include "daemon/system/hot_cpu.hpp"

#include <vector>

#include <catch2/catch.hpp>

namespace posed::system {

TEST_CASE("threads share a CPU until it is nearly full, and try again more and more rarely") {
  SharingRule rule;
  std::int64_t now_ns = 0;
  const auto looks = [&](double load, double for_s, double held_up = 0.05) {
    bool shared = false;
    for (const std::int64_t end_ns = now_ns + nanoseconds(for_s); now_ns < end_ns;) {
      shared = rule.share({.load = load, .held_up = held_up}, now_ns += kNanosPerSecond / 10);
    }
    return shared;
  };
  CHECK(looks(0.7, 60.0));
  CHECK_FALSE(looks(0.9, 0.1));
  CHECK_FALSE(looks(0.9, 9.9));
  CHECK(looks(0.9, 0.1));  // apart they may need more than together
  CHECK_FALSE(looks(0.9, 0.1));
  CHECK_FALSE(looks(0.9, 19.9));
  CHECK(looks(0.9, 0.1));
  CHECK(looks(0.7, 10.0));
  CHECK_FALSE(looks(0.9, 0.1));
  CHECK_FALSE(looks(1.3, 60.0));  // this cannot fit
  CHECK(looks(0.9, 0.1));
  int tries = 0;
  for (int look = 0; look < 36'000; ++look) tries += looks(0.9, 0.1) ? 1 : 0;
  CHECK(tries >= 8);
  CHECK(tries <= 12);  // in an hour
  CHECK(looks(0.7, 650.0));
  CHECK_FALSE(looks(0.2, 0.1, 0.3));  // another program has the CPU
  CHECK(looks(0.2, 10.0, 0.3));
  CHECK_FALSE(looks(0.2, 0.1, 0.3));
}

TEST_CASE("threads are held up by what others run, not by what is more urgent of their own") {
  using Threads = std::vector<ThreadShare>;
  CHECK(held_up_ns(Threads{}) == 0);
  CHECK(held_up_ns(Threads{{12, {30, 0}}, {11, {40, 30}}, {10, {20, 70}}}) == 0);
  CHECK(held_up_ns(Threads{{10, {20, 75}}, {12, {30, 2}}, {11, {40, 33}}}) == 2 + 3 + 5);
  CHECK(held_up_ns(Threads{{12, {30, 0}}, {11, {40, 0}}}) == 0);
}

}  // namespace posed::system
