// The clock of a recording that is replayed, with which the ages of its frames are measured.
#include <catch2/catch.hpp>

#include "daemon/tools/replay/broadcast.hpp"

namespace posed::replay {
namespace {

std::int64_t host_ns = 0;
std::int64_t host() noexcept { return host_ns; }

TEST_CASE("the recording's clock runs at the replay's speed from its first chunk") {
  host_ns = 5'000;
  TakeClock clock(2.0, 1'000'000, host);
  host_ns += 34'000'000;  // the log is still being opened
  CHECK(clock.now_ns() == 1'000'000);
  clock.reached(1'000'000);
  CHECK(clock.now_ns() == 1'000'000);
  host_ns += 100;
  CHECK(clock.now_ns() == 1'000'200);
  clock.reached(1'000'150);  // a little late: the clock never steps back
  CHECK(clock.now_ns() == 1'000'200);
  clock.reached(1'900'000);  // the silence before it was skipped
  CHECK(clock.now_ns() == 1'900'000);
  host_ns += 50;
  CHECK(clock.now_ns() == 1'900'100);
}

TEST_CASE("at full speed the recording's clock follows the replay") {
  host_ns = 0;
  TakeClock clock(0.0, 70, host);
  host_ns = 1'000'000;
  CHECK(clock.now_ns() == 70);
  clock.reached(90);
  host_ns = 2'000'000;
  CHECK(clock.now_ns() == 90);
}

}  // namespace
}  // namespace posed::replay
