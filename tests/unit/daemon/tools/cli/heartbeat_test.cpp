#include "daemon/tools/command/client.hpp"

#include <catch2/catch.hpp>

#include "proto/frame/time.hpp"

namespace posed::tools {
namespace {

constexpr std::int64_t kSecond = kNanosPerSecond;

TEST_CASE("a daemon that never sent a message counts as silent within two seconds") {
  Heartbeat heart(100 * kSecond);
  CHECK_FALSE(heart.silent_s(101 * kSecond));
  CHECK_FALSE(heart.ever_beat());
  REQUIRE(heart.silent_s(102 * kSecond));
  CHECK(*heart.silent_s(120 * kSecond) == Approx(20.0));
}

TEST_CASE("a silence is reported each time it has doubled, and its end is reported once") {
  Heartbeat heart(0);
  heart.beat(kSecond / 2);
  CHECK_FALSE(heart.silence_to_report(3 * kSecond));
  int reported = 0;
  double last_s = 0.0;
  for (int tenth = 30; tenth < 600; ++tenth) {
    const auto silence_s = heart.silence_to_report(tenth * kSecond / 10);
    if (!silence_s) continue;
    ++reported;
    CHECK(*silence_s >= 2.0 * last_s);
    last_s = *silence_s;
  }
  CHECK(reported == 5);  // after 3, 6, 12, 24 and 48 s
  CHECK_FALSE(heart.return_to_report());
  heart.beat(60 * kSecond);
  CHECK(heart.return_to_report().value() == Approx(59.5));
  CHECK_FALSE(heart.return_to_report());
  CHECK_FALSE(heart.silent_s(62 * kSecond));
  heart.beat(62 * kSecond);
  CHECK_FALSE(heart.return_to_report());
}

}  // namespace
}  // namespace posed::tools
