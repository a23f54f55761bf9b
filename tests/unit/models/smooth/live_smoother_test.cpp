// The live smoother as a pipeline stage: which frames it emits when, their headers, and the
// treatment of missing joints, irregular clocks and frames of other skeletons.
#include "models/smooth/live_smoother.hpp"

#include <limits>

#include <catch2/catch.hpp>

#include "tests/support/allocations.hpp"
#include "tests/support/smoothed.hpp"
#include "tests/support/synthetic_hand.hpp"

using namespace posed;
using namespace posed::test;
using smooth::LiveOptions;

namespace {

Skeleton finished(int channels) {
  Skeleton skeleton = body_with_channels(channels);
  skeleton.finish().value();
  return skeleton;
}

LiveOptions lagging(smooth::LiveLag lag, double noise_deg = 1.0) {
  return {.lag = lag, .noise_rad = noise_deg * kDegree};
}

std::int64_t at_60hz(long frame) { return frame * kNanosPerSecond / 60; }

Eigen::RowVectorXd wave(int channels, double t) {
  Eigen::RowVectorXd angles(channels);
  for (int c = 0; c < channels; ++c) angles[c] = 30.0 * std::sin(3.0 * t + 0.3 * c);
  return angles;
}

Frame wave_frame(const Skeleton& skeleton, long i, double rate_hz = 60.0) {
  const double t = static_cast<double>(i) / rate_hz;
  return frame_of(skeleton, wave(static_cast<int>(skeleton.channels.size()), t),
                  static_cast<std::uint64_t>(i + 1), nanoseconds(t));
}

double angle_deg(const Frame& frame, int channel) {
  return static_cast<double>(frame.angle_rad[static_cast<std::size_t>(channel)]) / kDegree;
}

}  // namespace

TEST_CASE("each frame is emitted once, with exactly the lag", "[live]") {
  const Skeleton skeleton = finished(6);
  const int lag = GENERATE(0, 1, 3, 5);
  smooth::LiveSmoother smoother(skeleton, lagging({.frames = lag}, 0.3));
  Frames out;
  for (long i = 0; i < 50; ++i) {
    const Frame frame = wave_frame(skeleton, i);
    smoother.process({.frame = frame}, out);
    REQUIRE(static_cast<int>(out.all.size()) == std::max(0L, i + 1 - lag));
  }
  for (std::size_t i = 0; i < out.all.size(); ++i) {
    const Frame& frame = out.all[i];
    CHECK(frame.header.sequence == i + 1);
    CHECK(frame.header.device_ns == wave_frame(skeleton, static_cast<long>(i)).header.device_ns);
    CHECK(frame.lag_frames == lag);
    CHECK(static_cast<double>(frame.lag_ms) == Approx(lag * 1000.0 / 60.0).margin(1e-3));
    CHECK(frame.quality == Quality::kMeasured);
    CHECK(frame.valid[0]);
    CHECK(angle_deg(frame, 2) == Approx(wave(6, static_cast<double>(i) / 60.0)[2]).margin(0.5));
    const std::vector<double> angles(frame.angle_rad.begin(), frame.angle_rad.begin() + 6);
    const auto turned = local_rotation(skeleton, 1, angles);
    CHECK(angle_between_rad(turned, to_eigen_double(frame.rotation_xyzw[1])) < 1e-6);
  }
  smoother.tick(0, out);  // silence: what waited comes out
  REQUIRE(out.all.size() == 50);
  CHECK(out.all.back().header.sequence == 50);
  CHECK(out.all.back().lag_frames == 0);
  smoother.flush(out);
  CHECK(out.all.size() == 50);
}

TEST_CASE("a lag in time becomes frames at the stream's own rate", "[live]") {
  const double rate_hz = GENERATE(10.0, 30.0, 60.0, 120.0, 240.0, 1000.0);
  const Skeleton skeleton = finished(3);
  smooth::LiveSmoother smoother(skeleton, lagging({.frames = 0, .seconds = 0.033}));
  Frames out;
  for (long i = 0; i < 60; ++i) {
    const Frame frame = wave_frame(skeleton, i, rate_hz);
    smoother.process({.frame = frame}, out);
  }
  const int frames = static_cast<int>(std::lround(0.033 * rate_hz));
  CHECK(static_cast<int>(out.all.size()) == 60 - frames);
  CHECK(out.all.back().lag_frames == frames);
  CHECK(out.all.front().header.sequence == 1);
}

TEST_CASE("the lag's bounds count frames up to 60 Hz and time above", "[live]") {
  CHECK(smooth::lag_frames({.frames = 9}, 1.0 / 30.0) == 5);
  CHECK(smooth::lag_frames({.frames = 0, .seconds = 0.17}, 1.0 / 30.0) == 5);
  CHECK(smooth::lag_frames({.frames = 0, .seconds = 0.17}, 1.0 / 60.0) == 5);
  CHECK(smooth::lag_frames({.frames = 0, .seconds = 0.17}, 1.0 / 120.0) == 20);
  CHECK(smooth::lag_frames({.frames = 99}, 1.0 / 240.0) == 40);
  CHECK(smooth::lag_frames({.frames = 3}, 0.0) == 3);
  CHECK(smooth::parse_lag("2").value().frames == 2);
  CHECK(smooth::parse_lag("33ms").value().seconds == Approx(0.033));
  CHECK(smooth::parse_lag("0ms").value().frames == 0);
  for (const char* bad : {"", "171", "-1", "1.5", "171ms", "ms", "fast", "1s", "nan", "1e99"}) {
    INFO(bad);
    CHECK_FALSE(smooth::parse_lag(bad));
  }
}

TEST_CASE("missing joints are bridged and marked predicted", "[live]") {
  const Skeleton skeleton = finished(6);
  smooth::LiveSmoother smoother(skeleton, lagging({.frames = 1}, 0.3));
  Frames out;
  for (long i = 0; i < 120; ++i) {
    Frame frame = wave_frame(skeleton, i);
    if (i >= 60 && i < 65) {
      frame.valid[1] = false;
      frame.rotation_xyzw[1] = kIdentity;
      frame.angle_rad[4] = std::numeric_limits<float>::quiet_NaN();
    }
    smoother.process({.frame = frame}, out);
    const double variance = out.variance_rad2.empty() ? 0.0 : out.variance_rad2[4];
    if (i == 50) CHECK(std::sqrt(variance) / kDegree < 0.3);
    if (i == 63) CHECK(std::sqrt(variance) / kDegree > 0.5);
  }
  for (std::size_t i = 58; i < 68; ++i) {
    const Frame& frame = out.all[i];
    const bool bridged = i >= 60 && i < 65;
    CHECK(frame.quality == (bridged ? Quality::kPredicted : Quality::kMeasured));
    CHECK(frame.valid[1]);
    CHECK(angle_deg(frame, 4) ==
          Approx(wave(6, static_cast<double>(i) / 60.0)[4]).margin(bridged ? 8.0 : 0.5));
  }
}

TEST_CASE("a joint that was never measured stays unknown", "[live]") {
  const Skeleton skeleton = finished(6);
  smooth::LiveSmoother smoother(skeleton, lagging({.frames = 0}));
  Frames out;
  for (long i = 0; i < 40; ++i) {
    Frame frame = wave_frame(skeleton, i);
    if (i < 20) frame.valid[1] = false;
    smoother.process({.frame = frame}, out);
    if (i == 10) {
      CHECK(std::isinf(out.variance_rad2[4]));
      CHECK(std::isfinite(out.variance_rad2[1]));
    }
  }
  CHECK_FALSE(out.all[10].valid[1]);
  CHECK(out.all[10].rotation_xyzw[1] == kIdentity);
  CHECK(out.all[20].valid[1]);
  CHECK(angle_deg(out.all[20], 4) == Approx(wave(6, 20 / 60.0)[4]).margin(0.01));
}

TEST_CASE("uneven and missing frames are handled by their times", "[live]") {
  const Skeleton skeleton = finished(3);
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(0.3, 1.7);
  std::normal_distribution<double> noise(0.0, 1.0);
  double even_sum = 0.0;
  double uneven_sum = 0.0;
  for (const bool even : {true, false}) {
    smooth::LiveSmoother smoother(skeleton, lagging({.frames = 1}));
    Frames out;
    double t = 0.0;
    double& sum = even ? even_sum : uneven_sum;
    for (long i = 0; i < 1000; ++i) {
      t += (even ? 1.0 : uniform(random)) / 60.0;
      if (!even && i % 50 == 0) t += 3.0 / 60.0;
      Eigen::RowVectorXd angles = wave(3, t);
      for (double& angle : angles) angle += noise(random);
      const Frame frame =
          frame_of(skeleton, angles, static_cast<std::uint64_t>(i + 1), nanoseconds(t));
      smoother.process({.frame = frame}, out);
      if (i < 40) continue;
      const Frame& last = out.all.back();
      sum += std::pow(angle_deg(last, 1) - wave(3, seconds(last.header.device_ns))[1], 2);
    }
  }
  CHECK(std::sqrt(uneven_sum / 960) < 1.2 * std::sqrt(even_sum / 960));
  CHECK(std::sqrt(even_sum / 960) < 0.7);
}

TEST_CASE("a clock that stands still or runs backwards does no harm", "[live]") {
  const Skeleton skeleton = finished(3);
  smooth::LiveSmoother smoother(skeleton, lagging({.frames = 1}));
  Frames out;
  std::mt19937_64 random(4);
  for (long i = 0; i < 400; ++i) {
    Frame frame = wave_frame(skeleton, i);
    constexpr std::int64_t kExtreme = std::numeric_limits<std::int64_t>::max();
    switch (random() % 8) {
      case 0:
        frame.header.device_ns = 0;
        break;
      case 1:
        frame.header.device_ns = kNoTime_ns;
        break;
      case 2:
        frame.header.device_ns = kExtreme;
        break;
      case 3:
        frame.header.device_ns = -kExtreme;
        break;
      default:
        break;
    }
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  REQUIRE(out.all.size() == 400);
  for (const Frame& frame : out.all) {
    for (int c = 0; c < 3; ++c) CHECK(std::abs(angle_deg(frame, c)) < 60.0);
  }
}

TEST_CASE("arrival times in bursts are drawn to the stream's period", "[live]") {
  const Skeleton skeleton = finished(3);
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> late(0.0, 0.012);
  double sum = 0.0;
  smooth::LiveSmoother smoother(skeleton, lagging({.frames = 1}, 0.3));
  Frames out;
  for (long i = 0; i < 600; ++i) {
    Frame frame = wave_frame(skeleton, i);
    frame.header.arrival_ns = at_60hz(i) + nanoseconds(late(random));
    frame.header.device_ns = kNoTime_ns;
    smoother.process({.frame = frame}, out);
    if (i < 60) continue;
    sum += std::pow(
        angle_deg(out.all.back(), 1) - wave(3, static_cast<double>(out.all.size() - 1) / 60.0)[1],
        2);
  }
  CHECK(std::sqrt(sum / 540) < 0.3);
}

TEST_CASE("full turns and the two Euler forms of a rotation cause no jumps", "[live]") {
  const Skeleton skeleton = finished(3);
  smooth::LiveSmoother smoother(skeleton, lagging({.frames = 1}, 0.3));
  Frames out;
  for (long i = 0; i < 200; ++i) {
    const double turn_deg = 2.0 * static_cast<double>(i);
    Eigen::RowVectorXd angles(3);
    angles << std::remainder(turn_deg, 360.0), 20.0, 10.0;
    if (i % 7 == 3) angles << angles[0] + 180.0, 180.0 - angles[1], angles[2] - 180.0;
    const Frame frame = frame_of(skeleton, angles, static_cast<std::uint64_t>(i + 1), at_60hz(i));
    smoother.process({.frame = frame}, out);
    if (out.all.size() < 40) continue;
    const long shown = static_cast<long>(out.all.size()) - 1;
    const Frame truth =
        frame_of(skeleton, Eigen::RowVector3d(2.0 * static_cast<double>(shown), 20.0, 10.0), 1, 0);
    CHECK(angle_between_rad(to_eigen_double(out.all.back().rotation_xyzw[0]),
                            to_eigen_double(truth.rotation_xyzw[0])) < 0.1 * kDegree);
  }
}

TEST_CASE("frames of another skeleton pass through in order", "[live]") {
  const Skeleton skeleton = finished(6);
  smooth::LiveSmoother smoother(skeleton, lagging({.frames = 3}));
  Frames out;
  for (long i = 0; i < 20; ++i) {
    Frame frame = wave_frame(skeleton, i);
    if (i == 10) frame.skeleton += 1;
    if (i == 11) frame.angle_count = 0;
    smoother.process({.frame = frame}, out);
  }
  smoother.flush(out);
  REQUIRE(out.all.size() == 20);
  for (std::size_t i = 0; i < 20; ++i) CHECK(out.all[i].header.sequence == i + 1);
  CHECK(out.all[10].lag_frames == 0);
}

TEST_CASE("the same frames give the same bits, without allocation", "[live]") {
  const Skeleton skeleton = finished(45);
  const SyntheticHand hand = synthetic_hand(4, 3);
  const Motion measured = noisy(hand.angles, 1.0, 4);
  struct Sum final : StageOut {
    void frame(const StageFrame& made) noexcept override {
      const Frame& frame = made.frame;
      for (int c = 0; c < 45; ++c) total += static_cast<double>(frame.angle_rad[c]) * (c + 1);
    }
    double total = 0.0;
  };
  Sum first;
  Sum again;
  smooth::LiveSmoother smoother(skeleton, {});  // the sensor noise is estimated, too
  for (Sum* sum : {&first, &again}) {
    smoother.reset();
    for (long i = 0; i < measured.rows(); ++i) {
      Frame frame = frame_of(skeleton, measured.row(i), static_cast<std::uint64_t>(i), at_60hz(i));
      if (i % 20 == 0) frame.valid[3] = false;
      const auto before = allocations();
      smoother.process({.frame = frame}, *sum);
      if (allocations() != before) FAIL("step takes memory");
    }
    const auto before = allocations();
    smoother.flush(*sum);
    smoother.reset();
    CHECK(allocations() == before);
  }
  CHECK(first.total == again.total);
}
