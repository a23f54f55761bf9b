// No wake-up is missed: when one of two producers has added something, the consumer is woken. Also
// runs under the thread sanitizer; for the argument for weak memory models see EventFd.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <thread>

#include "daemon/system/clock.hpp"
#include "daemon/system/event_fd.hpp"

namespace posed::system {

TEST_CASE("a consumer that sleeps is woken for each element of two producers") {
  constexpr std::uint64_t kEach = 20'000;
  constexpr std::int64_t kPatience_ns = 10'000'000'000;  // reached only if a wake-up is missed
  const auto wake = EventFd::open().value();
  const auto poller = Poller::open().value();
  REQUIRE(poller->add(*wake));
  struct Producer {
    std::atomic<std::uint64_t> put{0}, taken{0};
  };
  std::array<Producer, 2> producers;
  const auto produce = [&](Producer& mine) {
    for (std::uint64_t i = 1; i <= kEach; ++i) {
      mine.put.store(i, std::memory_order_release);
      wake->notify();
      // Waits for the consumer from time to time, so that it falls asleep.
      while (i % 4 == 0 && mine.taken.load(std::memory_order_acquire) < i) {
        std::this_thread::yield();
      }
    }
  };
  // Whether there are elements that have not been consumed.
  const auto more = [&] {
    return std::ranges::any_of(producers, [](const Producer& producer) {
      return producer.put.load(std::memory_order_acquire) !=
             producer.taken.load(std::memory_order_relaxed);
    });
  };
  const auto take = [&] {
    std::uint64_t sum = 0;
    for (Producer& producer : producers) {
      const std::uint64_t put = producer.put.load(std::memory_order_acquire);
      producer.taken.store(put, std::memory_order_release);
      sum += put;
    }
    return sum;
  };
  std::jthread first([&] { produce(producers[0]); });
  std::jthread second([&] { produce(producers[1]); });
  int missed = 0, sleeps = 0;
  std::uint64_t seen = 0;
  while ((seen = take()) < 2 * kEach && missed == 0) {
    wake->going_to_sleep();
    if (!more()) {
      const std::int64_t before_ns = monotonic_ns();
      static_cast<void>(poller->wait(kPatience_ns));
      if (monotonic_ns() - before_ns >= kPatience_ns) ++missed;
      ++sleeps;
    }
    wake->awake();
  }
  for (Producer& producer : producers) producer.taken.store(kEach);  // ends the producers
  CHECK(sleeps > 0);
  CHECK(missed == 0);
  CHECK(seen == 2 * kEach);
}

}  // namespace posed::system
