// Mapping a device's clock to the host's: drift, batches, wraps and restarts, with a device whose
// true time the test knows.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "drivers/device_clock.hpp"
#include "drivers/unrolled_counter.hpp"
#include "proto/frame/device_time.hpp"

namespace posed::drivers {
namespace {

constexpr double kRate_hz = 150.0;
constexpr std::int64_t kBatch_ns = 8'000'000;

// A glove that counts milliseconds in 16 bits with an inaccurate crystal, behind a USB bridge that
// delivers every 8 ms.
struct DriftingGlove {
  double drift_ppm = 100.0;
  std::int64_t started_ns = 123'456'789'012;  // on the host's clock
  std::mt19937 random{5};

  struct Packet {
    std::int64_t true_ns;  // host time of the measurement
    std::uint16_t count;
    std::int64_t arrival_ns;
  };
  Packet packet(int i) {
    const auto true_ns = started_ns + static_cast<std::int64_t>(i * 1e9 / kRate_hz);
    const double ticks = static_cast<double>(true_ns - started_ns) * (1.0 + drift_ppm * 1e-6);
    const auto count = static_cast<std::uint16_t>(static_cast<std::int64_t>(ticks / 1e6) % 65536);
    const std::int64_t handed_ns = (true_ns / kBatch_ns + 1) * kBatch_ns;
    return {true_ns, count, handed_ns + static_cast<std::int64_t>(random() % 200'000)};
  }
};

std::int64_t percentile(std::vector<std::int64_t> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

TEST_CASE("100 ppm, batches of 8 ms, a wrap of 16 bits: mapped within 1 ms after 30 s") {
  DriftingGlove device;
  UnrolledCounter counter(16);
  DeviceClock clock;
  std::vector<std::int64_t> errors_ns;
  std::int64_t last_host_ns = 0;
  std::int64_t largest_step_ns = 0;
  for (int i = 0; i < static_cast<int>(150 * kRate_hz); ++i) {  // the counter wraps twice
    const auto packet = device.packet(i);
    const std::int64_t device_ns = counter.to(packet.count).ticks * 1'000'000;
    const ClockMapping mapping = clock.observe(device_ns, packet.arrival_ns);
    REQUIRE(mapping.valid);
    const std::int64_t host_ns = to_host_ns(mapping, device_ns);
    if (packet.true_ns - device.started_ns > 30 * kNanosPerSecond) {
      errors_ns.push_back(std::abs(host_ns - packet.true_ns));
      // From packet to packet host time advances by the period, within one tick of a millisecond.
      const auto step_ns = host_ns - last_host_ns - std::llround(1e9 / kRate_hz);
      largest_step_ns = std::max<std::int64_t>(largest_step_ns, std::abs(step_ns));
    }
    last_host_ns = host_ns;
  }
  WARN("error p50 " << percentile(errors_ns, 0.5) / 1000 << " us, p99 "
                    << percentile(errors_ns, 0.99) / 1000 << " us, largest step "
                    << largest_step_ns / 1000 << " us, drift " << clock.mapping().drift_ppm);
  CHECK(percentile(errors_ns, 0.99) <= 1'000'000);
  CHECK(largest_step_ns < 2'000'000);
  CHECK(clock.mapping().drift_ppm == Approx(-device.drift_ppm).margin(20.0));
}

TEST_CASE("a device that restarts is mapped again, and impossible times change nothing") {
  DeviceClock clock;
  std::int64_t arrival_ns = 5 * kNanosPerSecond;
  std::int64_t device_ns = 0;
  for (int i = 0; i < 3000; ++i) {
    clock.observe(device_ns += 10'000'000, arrival_ns += 10'000'000);
  }
  CHECK(to_host_ns(clock.mapping(), device_ns) == arrival_ns);
  const ClockMapping before = clock.observe(kNoTime_ns, arrival_ns);
  CHECK(before.offset_ns == clock.mapping().offset_ns);
  device_ns = 7;  // switched off and on again
  for (int i = 0; i < 10; ++i) clock.observe(device_ns += 10'000'000, arrival_ns += 10'000'000);
  CHECK(to_host_ns(clock.mapping(), device_ns) == arrival_ns);
  CHECK(clock.jumps() == 1);
  // Unplugged for a minute during which its time stood still.
  arrival_ns += 60 * kNanosPerSecond;
  for (int i = 0; i < 300; ++i) clock.observe(device_ns += 10'000'000, arrival_ns += 10'000'000);
  CHECK(to_host_ns(clock.mapping(), device_ns) == arrival_ns);
  // Times at the ends of the number range.
  clock.observe(std::numeric_limits<std::int64_t>::max(), arrival_ns);
  clock.observe(device_ns, std::numeric_limits<std::int64_t>::min() + 1);
  CHECK(to_host_ns(clock.mapping(), device_ns) == arrival_ns);
}

}  // namespace
}  // namespace posed::drivers
