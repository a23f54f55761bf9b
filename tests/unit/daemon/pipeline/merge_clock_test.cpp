// Merging by the clocks of the devices: a body at 120 Hz and a glove at 100 Hz, each with a clock
// of its own that is 50 ppm fast or slow, on links with jitter, for ten minutes.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "drivers/device_clock.hpp"
#include "tests/support/dice.hpp"
#include "tests/support/merge_rig.hpp"
#include "tests/support/seeds.hpp"

namespace posed::pipeline {
namespace {

constexpr double kLength_s = 600.0;
constexpr double kSettled_s = 30.0;  // the clocks' drift is known by then
constexpr double kRamp_rad_per_s = 0.6, kRamp_s = 2.0;

// A device: when it measures its n-th frame, what its clock says then, and when the frame comes.
class MergedDevice {
 public:
  MergedDevice(double rate_hz, double ppm, std::uint64_t seed)
      : rate_hz_(rate_hz), scale_(1.0 + ppm * 1e-6), dice_(seed) {}

  [[nodiscard]] double time_s(std::uint64_t n) const { return static_cast<double>(n) / rate_hz_; }
  // The header of the next frame; the link takes 1 ms at least, mostly up to 3, rarely 8.
  Header next() {
    const double now_s = time_s(n_++);
    const double delay_s = 0.001 + dice_.within(0.0, dice_.chance(0.02) ? 0.007 : 0.002);
    Header header;
    header.sequence = n_;
    header.device_ns = nanoseconds(now_s * scale_) + 777'000'000'000;
    header.arrival_ns = std::max(last_ns_, 1'000'000'000 + nanoseconds(now_s + delay_s));
    last_ns_ = header.arrival_ns;
    header.clock = clock_.observe(header.device_ns, header.arrival_ns);
    return header;
  }

 private:
  double rate_hz_, scale_;
  test::Dice dice_;
  std::uint64_t n_ = 0;
  std::int64_t last_ns_ = 0;
  drivers::DeviceClock clock_;
};

// How far the fingers are bent: a ramp, which interpolation between two frames meets exactly, and
// which therefore tells the time at which a pose was measured.
double ramp_rad(double at_s) { return 0.2 + kRamp_rad_per_s * std::fmod(at_s, kRamp_s); }
double sine_rad(double at_s) { return 0.7 + 0.5 * std::sin(2.0 * std::numbers::pi * 0.8 * at_s); }

// [s] by sequence of the body, of what leaves the stage: how far the hand is bent.
std::vector<double> merged_run(double (*bent_rad)(double), double length_s) {
  const auto glove = test::glove_skeleton(Side::kLeft);
  const auto body = test::walker_skeleton();
  test::MergeRig rig(test::merge_context(body, glove));
  const auto map = merge::HandMap::bind("merged", Side::kLeft, *rig.skeleton, *rig.skeleton,
                                        merge::Wrist::kBody);
  std::vector<double> bent;
  rig.each = [&](const test::MergeRig::Out& out) {
    CHECK(out.frame.header.sequence == bent.size() + 1);
    bent.push_back(rotation_log(map->read(out.frame).turn[4]).norm());
  };
  MergedDevice bodies(120.0, 50.0, 1), gloves(100.0, -50.0, 2);
  Header next_body = bodies.next(), next_glove = gloves.next();
  const Frame pose = test::body_frame(*body, 1, 0);
  while (bodies.time_s(next_body.sequence) < length_s) {
    if (next_glove.arrival_ns < next_body.arrival_ns) {
      Frame frame = test::glove_frame(*glove, bent_rad(gloves.time_s(next_glove.sequence - 1)), 0);
      frame.header = next_glove;
      rig.glove(0, frame);
      next_glove = gloves.next();
    } else {
      Frame frame = pose;
      frame.header = next_body;
      rig.body(frame);
      next_body = bodies.next();
    }
  }
  rig.flush();
  return bent;
}

}  // namespace

TEST_CASE("for ten minutes each frame gets the hand of its own time, and none is lost") {
  const double length_s = test::few_seeds() ? kLength_s / 5.0 : kLength_s;
  const std::vector<double> bent = merged_run(ramp_rad, length_s);
  CHECK(static_cast<double>(bent.size()) >= 120.0 * length_s - 10.0);
  std::vector<double> error_ms;
  for (std::size_t i = 0; i < bent.size(); ++i) {
    const double at_s = static_cast<double>(i) / 120.0;
    const double phase_s = std::fmod(at_s, kRamp_s);
    const bool at_step = phase_s < 0.05 || phase_s > kRamp_s - 0.05;
    if (at_s < kSettled_s || at_step) continue;
    error_ms.push_back(1e3 * std::abs(bent[i] - ramp_rad(at_s)) / kRamp_rad_per_s);
  }
  std::ranges::sort(error_ms);
  const double median_ms = error_ms[error_ms.size() / 2];
  const double p99_ms = error_ms[error_ms.size() * 99 / 100];
  WARN(bent.size() << " frames: the hand is " << median_ms << " ms off (median), p99 " << p99_ms
                   << " ms, at most " << error_ms.back() << " ms");
  CHECK(p99_ms <= 2.0);
  CHECK(error_ms.back() <= 15.0);
}

// At 0.8 Hz and 0.5 rad the interpolation over 10 ms is off by at most 1.6e-4 rad, and half a
// millisecond between the clocks by 1.3e-3 rad.
TEST_CASE("a known motion of the hand comes out as it is") {
  const std::vector<double> bent = merged_run(sine_rad, 90.0);
  std::vector<double> error_rad;
  for (std::size_t i = 0; i < bent.size(); ++i) {
    const double at_s = static_cast<double>(i) / 120.0;
    if (at_s < kSettled_s) continue;
    error_rad.push_back(std::abs(bent[i] - sine_rad(at_s)));
  }
  std::ranges::sort(error_rad);
  const double p99_rad = error_rad[error_rad.size() * 99 / 100];
  WARN("p99 " << p99_rad << " rad");
  CHECK(p99_rad < 1.6e-4 + 1.3e-3);
}

}  // namespace posed::pipeline
