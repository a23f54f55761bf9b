#include "daemon/system/moderation.hpp"

#include <catch2/catch.hpp>

namespace posed::system {
namespace {

// Turns for a second, each with one element; returns how many of them are followed by a rest.
int rests(Moderation& moderation, std::int64_t& now_ns, std::uint64_t& handled, int rate_hz) {
  int rests = 0;
  for (int i = 0; i < rate_hz; ++i) {
    now_ns += kNanosPerSecond / rate_hz;
    rests += moderation.rest_ns(++handled, now_ns) == Moderation::kRest_ns ? 1 : 0;
  }
  return rests;
}

}  // namespace

TEST_CASE("a thread rests only while it handles thousands of elements a second") {
  Moderation moderation;
  std::int64_t now_ns = 0;
  std::uint64_t handled = 0;
  CHECK(rests(moderation, now_ns, handled, 120) == 0);
  CHECK(rests(moderation, now_ns, handled, 32 * 120) == 0);
  CHECK(rests(moderation, now_ns, handled, 64 * 120) > 7'000);
  CHECK(rests(moderation, now_ns, handled, 120) <= 2);  // the end of a window is noticed late
}

}  // namespace posed::system
