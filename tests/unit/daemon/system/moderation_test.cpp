#include "daemon/system/moderation.hpp"

#include <catch2/catch.hpp>

namespace posed::system {
namespace {

// Turns for a second, each with one element; returns how many of them are followed by a rest of
// this length, 0: of any.
int rests(Moderation& moderation, std::int64_t& now_ns, std::uint64_t& handled, int rate_hz,
          std::int64_t length_ns = 0) {
  int rests = 0;
  for (int i = 0; i < rate_hz; ++i) {
    now_ns += kNanosPerSecond / rate_hz;
    const std::int64_t rest_ns = moderation.rest_ns(++handled, now_ns);
    rests += rest_ns > 0 && (length_ns == 0 || rest_ns == length_ns) ? 1 : 0;
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
  CHECK(rests(moderation, now_ns, handled, 64 * 120, Moderation::kRest_ns) > 7'000);
  CHECK(rests(moderation, now_ns, handled, 128 * 120, 2 * Moderation::kRest_ns) > 15'000);
  CHECK(rests(moderation, now_ns, handled, 120) <= 2);  // the end of a window is noticed late
}

}  // namespace posed::system
