// No wake-up is missed: whatever two producers put where the consumer looks, it is woken for it.
// Under the thread sanitizer, too; the argument for weak memory stands at Wake.
#include <catch2/catch.hpp>

#include <atomic>
#include <cstdint>
#include <thread>

#include "daemon/pipeline/clock.hpp"
#include "daemon/pipeline/wake.hpp"

namespace posed::pipeline {

TEST_CASE("a consumer that sleeps is woken for each element of two producers") {
  constexpr std::uint64_t kEach = 20'000;
  constexpr std::int64_t kPatience_ns = 10'000'000'000;  // over only when a wake-up is missed
  const auto wake = Wake::open().value();
  const auto poller = Poller::open().value();
  REQUIRE(poller->add(*wake));
  std::atomic<std::uint64_t> put[2] = {0, 0};
  std::atomic<std::uint64_t> taken{0};
  const auto produce = [&](std::atomic<std::uint64_t>& mine) {
    for (std::uint64_t i = 1; i <= kEach; ++i) {
      mine.store(i, std::memory_order_release);
      wake->ring();
      // In step with the consumer every now and then, so that it falls asleep.
      while (i % 4 == 0 && taken.load(std::memory_order_acquire) < i) std::this_thread::yield();
    }
  };
  const auto there = [&] {
    return put[0].load(std::memory_order_acquire) + put[1].load(std::memory_order_acquire);
  };
  std::jthread first([&] { produce(put[0]); });
  std::jthread second([&] { produce(put[1]); });
  std::uint64_t seen = 0;
  int missed = 0;
  while (seen < 2 * kEach && missed == 0) {
    seen = there();
    taken.store(seen, std::memory_order_release);
    wake->going_to_sleep();
    if (there() == seen && seen < 2 * kEach) {
      const std::int64_t before_ns = monotonic_ns();
      static_cast<void>(poller->wait(kPatience_ns));
      if (monotonic_ns() - before_ns >= kPatience_ns) ++missed;
    }
    wake->awake();
  }
  taken.store(2 * kEach, std::memory_order_release);  // lets the producers end
  CHECK(missed == 0);
  CHECK(seen == 2 * kEach);
}

}  // namespace posed::pipeline
