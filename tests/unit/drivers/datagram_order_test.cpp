// Order and time of datagrams: new, late and repeated ones, restarts, numbers that wrap or stand,
// pauses.
#include <catch2/catch.hpp>

#include "drivers/active_time.hpp"
#include "drivers/datagram_order.hpp"
#include "drivers/timestamp_clock.hpp"

namespace posed::drivers {
namespace {

constexpr auto kOk = Outcome::kOk;
constexpr auto kLate = Outcome::kLate;
constexpr auto kDuplicate = Outcome::kDuplicate;

}  // namespace

TEST_CASE("a datagram that was overtaken is late, one that came before is a duplicate") {
  DatagramOrder order(32);
  CHECK(order.accept(100) == kOk);
  CHECK(order.accept(103) == kOk);
  CHECK(order.accept(102) == kLate);
  CHECK(order.accept(102) == kDuplicate);
  CHECK(order.accept(100) == kDuplicate);
  CHECK(order.accept(103) == kDuplicate);
  CHECK(order.accept(60) == kLate);
  CHECK(order.accept(104) == kOk);
}

TEST_CASE("numbers wrap and leap") {
  DatagramOrder order(16);
  CHECK(order.accept(0xFFFE) == kOk);
  CHECK(order.accept(1) == kOk);
  CHECK(order.accept(0xFFFF) == kLate);
  CHECK(order.accept(0xFFFE) == kDuplicate);
  CHECK(order.accept(20'000) == kOk);
  CHECK(order.accept(19'999) == kLate);  // nothing of before the leap counts as seen
  DatagramOrder wide(64);
  CHECK(wide.accept(5) == kOk);
  CHECK(wide.accept(std::uint64_t{1} << 62) == kOk);
  CHECK(wide.accept((std::uint64_t{1} << 62) - 1) == kLate);
}

TEST_CASE("a device that restarts goes on at once, or soon if its numbers were just used") {
  DatagramOrder order(32);
  for (std::uint64_t i = 1000; i < 1100; ++i) CHECK(order.accept(i) == kOk);
  CHECK(order.accept(0) == kOk);
  CHECK(order.accept(1) == kOk);
  CHECK(order.accept(2) == kOk);
  int refused = 0;
  std::uint64_t number = 0;
  while (order.accept(number++) != kOk) ++refused;
  CHECK(refused == 3);  // 0, 1 and 2 came just before
  DatagramOrder early(32);
  for (std::uint64_t i = 0; i < 50; ++i) CHECK(early.accept(i) == kOk);
  refused = 0;
  number = 0;
  while (early.accept(number++) != kOk) ++refused;
  CHECK(refused == 32);
  CHECK(early.accept(number) == kOk);
}

TEST_CASE("a number that never changes is no reason to drop all datagrams") {
  DatagramOrder order(32);
  CHECK(order.accept(7) == kOk);
  int refused = 0;
  while (order.accept(7) != kOk) ++refused;
  CHECK(refused == 32);
  for (int i = 0; i < 100; ++i) CHECK(order.accept(7) == kOk);
  CHECK(order.accept(8) == kOk);
  CHECK(order.accept(8) == kDuplicate);
  CHECK(order.accept(7) == kDuplicate);
}

TEST_CASE("a timestamp that stands is no clock, but its frames are new") {
  TimestampClock clock;
  CHECK(clock.accept(1.0) == kOk);
  CHECK(clock.accept(1.5) == kOk);
  CHECK(clock.device_ns() == 500'000'000);
  int refused = 0;
  while (clock.accept(1.5) != kOk) ++refused;
  CHECK(refused == 32);
  CHECK(clock.accept(1.5) == kOk);
  CHECK(clock.device_ns() == kNoTime_ns);
  CHECK(clock.accept(1.75) == kOk);
  CHECK(clock.device_ns() == 750'000'000);
}

TEST_CASE("heard time leaves out the sender's pauses") {
  ActiveTime received;
  CHECK(received.to(5'000'000'000) == 5'000'000'000);
  CHECK(received.to(5'100'000'000) == 5'100'000'000);
  CHECK(received.to(9'000'000'000) == 5'600'000'000);
  CHECK(received.to(8'000'000'000) == 5'600'000'000);  // never back
  CHECK(received.to(8'010'000'000) == 5'610'000'000);
}

}  // namespace posed::drivers
