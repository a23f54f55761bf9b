#include <catch2/catch.hpp>

#include <thread>

#include "daemon/pipeline/ring.hpp"
#include "daemon/pipeline/worker.hpp"
#include "daemon/publish/published_stream.hpp"
#include "daemon/publish/publisher.hpp"
#include "daemon/system/event_fd.hpp"

namespace posed::pipeline {

using system::EventFd;
using system::kForever_ns;
using system::Poller;

TEST_CASE("a ring holds half a second and refuses when full") {
  CHECK(ring_slots(0.0) == 64);
  CHECK(ring_slots(3840.0) == 1920);
  Ring<int> ring(4);
  CHECK(ring.empty());
  for (int i = 0; i < 4; ++i) CHECK(ring.push(i));
  CHECK_FALSE(ring.has_room());
  CHECK_FALSE(ring.push(4));
  int sum = 0;
  while (ring.consume([&](const int& value) { sum = 10 * sum + value; })) {
  }
  CHECK(sum == 123);
}

TEST_CASE("no element is missed by a consumer that falls asleep") {
  constexpr int kElements = 20'000;
  Ring<int> ring(64);
  const auto wake = EventFd::open().value();
  const auto poller = Poller::open().value();
  REQUIRE(poller->add(*wake));
  std::thread producer([&] {
    for (int i = 1; i <= kElements; ++i) {
      while (!ring.push(i)) std::this_thread::yield();
      wake->notify();
    }
  });
  int last = 0;
  int out_of_order = 0;
  while (last < kElements) {
    while (ring.consume([&](const int& value) {
      if (value != last + 1) ++out_of_order;
      last = value;
    })) {
    }
    wake->going_to_sleep();
    // If a wake-up were missed, this test would never end.
    if (ring.empty() && last < kElements) static_cast<void>(poller->wait(kForever_ns));
    wake->awake();
  }
  producer.join();
  CHECK(out_of_order == 0);
}

TEST_CASE("frames are shed behind 50 ms of newer ones, never behind fewer than three") {
  CHECK(shed_depth(30.0) == 3);
  CHECK(shed_depth(120.0) == 6);
  CHECK(shed_depth(1000.0) == 50);
}

TEST_CASE("a subscriber's queue is a quarter of a second deep, at least 16") {
  CHECK(publish::send_high_water_mark(30.0) == 16);
  CHECK(publish::send_high_water_mark(3840.0) == 960);
}

TEST_CASE("percentiles are at most a bucket too high, the maximum is exact") {
  publish::LatencyHistogram histogram;
  CHECK(histogram.percentile_us(0.5) == 0.0);
  for (int i = 1; i <= 1000; ++i) histogram.add(i * 1000);
  CHECK(histogram.percentile_us(0.5) >= 500.0);
  CHECK(histogram.percentile_us(0.5) <= 500.0 * 1.13);
  CHECK(histogram.percentile_us(0.99) >= 990.0);
  CHECK(histogram.percentile_us(0.99) <= 1000.0);
  CHECK(histogram.max_us() == 1000.0);
  histogram.add(-5);
  CHECK(histogram.count() == 1001);
  histogram.clear();
  CHECK(histogram.count() == 0);
}

}  // namespace posed::pipeline
