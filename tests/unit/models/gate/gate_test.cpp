// The stage `gate`: what it drops, what it believes, and what that does for the smoother behind it.
#include "models/gate/gate_stage.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <random>
#include <sstream>
#include <utility>
#include <vector>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/rotation.hpp"
#include "tests/bench/baselines.hpp"
#include "tests/support/processor_time.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/smoothed.hpp"
#include "tests/support/synthetic_hand.hpp"

namespace posed::gate {
namespace {

std::unique_ptr<Stage> make_gate(const Skeleton& skeleton, double rate_hz) {
  const StageType& type = gate_type();
  Parameters parameters;
  for (const ParameterSpec& spec : type.parameters) {
    parameters[std::string(spec.name)] = spec.default_value;
  }
  StageContext context{.skeleton = std::make_shared<const Skeleton>(skeleton),
                       .rate_hz = rate_hz,
                       .parameters = parameters};
  return type.make(context, nullptr).value();
}

Skeleton toy(int channels) {
  Skeleton skeleton = test::body_with_channels(channels);
  skeleton.finish().value();
  return skeleton;
}

// The motion as the gate lets it through [deg]; NaN where it drops.
test::Motion gated(const test::Motion& measured, double rate_hz) {
  const Skeleton skeleton = toy(static_cast<int>(measured.cols()));
  const auto gate = make_gate(skeleton, rate_hz);
  test::Frames out;
  for (Eigen::Index t = 0; t < measured.rows(); ++t) {
    gate->process(
        {.frame = test::frame_of(skeleton, measured.row(t), static_cast<std::uint64_t>(t + 1),
                                 nanoseconds(static_cast<double>(t) / rate_hz))},
        out);
  }
  REQUIRE(std::ssize(out.all) == measured.rows());
  test::Motion result(measured.rows(), measured.cols());
  for (std::size_t t = 0; t < out.all.size(); ++t) {
    for (Eigen::Index c = 0; c < measured.cols(); ++c) {
      result(static_cast<Eigen::Index>(t), c) =
          static_cast<double>(out.all[t].angle_rad[static_cast<std::size_t>(c)]) / kDegree;
    }
  }
  return result;
}

// `share` of the values are off by 25 degrees, as those of a flaky connector.
test::Motion spoilt(test::Motion motion, double share, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(0.0, 1.0);
  for (double& value : motion.reshaped()) {
    if (any(random) < share) value += any(random) < 0.5 ? 25.0 : -25.0;
  }
  return motion;
}

long missing(const test::Motion& motion) { return (motion.array() != motion.array()).count(); }

// Through the gate, where there is one, and the smoother; as a glove sends it.
double error_deg(const test::Motion& truth, const test::Motion& measured, double rate_hz, int lag,
                 double noise_deg, bool with_gate) {
  const Skeleton skeleton = toy(static_cast<int>(measured.cols()));
  const auto gate = make_gate(skeleton, rate_hz);
  smooth::LiveSmoother smoother(skeleton, test::live_options(lag, noise_deg));
  struct Behind final : StageOut {
    Stage& next;
    StageOut& out;
    Behind(Stage& to, StageOut& end) : next(to), out(end) {}
    void frame(const StageFrame& made) noexcept override { next.process(made, out); }
  };
  test::Frames out;
  Behind behind(smoother, out);
  for (Eigen::Index t = 0; t < measured.rows(); ++t) {
    const Frame frame = test::frame_of(skeleton, measured.row(t), static_cast<std::uint64_t>(t + 1),
                                       nanoseconds(static_cast<double>(t) / rate_hz));
    if (with_gate) {
      gate->process({.frame = frame}, behind);
    } else {
      smoother.process({.frame = frame}, out);
    }
  }
  smoother.flush(out);
  test::Motion result(measured.rows(), measured.cols());
  for (std::size_t t = 0; t < out.all.size(); ++t) {
    for (Eigen::Index c = 0; c < measured.cols(); ++c) {
      result(static_cast<Eigen::Index>(t), c) =
          static_cast<double>(out.all[t].angle_rad[static_cast<std::size_t>(c)]) / kDegree;
    }
  }
  return bench::rms_deg(result, truth);
}

}  // namespace

TEST_CASE("the gate drops a value that contradicts its motion, and only that") {
  test::Motion motion(60, 3);
  for (Eigen::Index t = 0; t < motion.rows(); ++t) {
    motion.row(t) << 3.0 * static_cast<double>(t), 40.0 * std::sin(0.2 * static_cast<double>(t)),
        10.0;
  }
  motion(30, 0) += 25.0;
  motion(40, 2) -= 25.0;
  const test::Motion through = gated(motion, 60.0);
  CHECK(missing(through) == 2);
  CHECK(std::isnan(through(30, 0)));
  CHECK(std::isnan(through(40, 2)));
  CHECK(through(30, 1) == Approx(motion(30, 1)).margin(1e-4));
}

TEST_CASE("the gate believes what persists") {
  test::Motion motion = test::Motion::Zero(60, 3);
  motion.block(20, 0, 40, 1).array() += 90.0;  // a calibration, or a glove put on
  const test::Motion through = gated(motion, 60.0);
  CHECK(std::isnan(through(20, 0)));
  CHECK(std::isnan(through(21, 0)));  // a fault may last for two samples
  CHECK(missing(through) == 2);
  CHECK(through(22, 0) == Approx(90.0));
}

TEST_CASE("where suspects were true the gate believes them, until they are false again") {
  // A finger that closes alone, by 1,200 deg/s within a frame.
  test::Motion motion = test::Motion::Zero(2000, 3);
  for (Eigen::Index t = 0; t < motion.rows(); ++t) {
    const auto phase = static_cast<double>(t % 60);
    const double way = std::clamp(phase - 20.0, 0.0, 3.0) - std::clamp(phase - 45.0, 0.0, 3.0);
    motion(t, 0) = t < 1000 ? 30.0 * way : 0.0;
    motion(t, 1) = 10.0 * std::sin(0.05 * static_cast<double>(t));
  }
  for (Eigen::Index t = 1200; t < motion.rows(); t += 10) motion(t, 0) += 25.0;
  const test::Motion through = gated(motion, 60.0);
  CHECK(missing(through.topRows(200)) > 0);
  CHECK(missing(through.middleRows(200, 800)) == 0);
  CHECK(missing(through.bottomRows(200)) == 20);
}

TEST_CASE("a contact that is lost and comes back makes no single spike believed") {
  for (const int lost : {3, 4, 8}) {
    test::Motion motion = test::Motion::Zero(900, 3);
    for (Eigen::Index t = 0; t < motion.rows(); ++t) {
      motion(t, 1) = 10.0 * std::sin(0.05 * static_cast<double>(t));
      if (t % 100 < lost) motion(t, 0) = 40.0;
      if (t % 100 == 50) motion(t, 0) = 25.0;
    }
    const test::Motion through = gated(motion, 60.0);
    INFO(lost << " samples lost");
    for (Eigen::Index t = 50; t < motion.rows(); t += 100) CHECK(std::isnan(through(t, 0)));
    for (Eigen::Index t = 101 + lost; t < motion.rows(); t += 100) {
      CHECK(through(t, 0) == Approx(0.0).margin(1e-6));  // back with its second sample
    }
  }
}

TEST_CASE("soon after a step a single sample where it came from is a spike") {
  test::Motion motion = test::Motion::Zero(60, 3);
  motion.block(20, 0, 40, 1).array() += 40.0;
  motion(26, 0) = 2.0;
  const test::Motion through = gated(motion, 60.0);
  CHECK(missing(through) == 3);  // two of the step
  CHECK(std::isnan(through(26, 0)));
  CHECK(through(27, 0) == Approx(40.0));
}

TEST_CASE("the gate lets a fast hand, repeats and steps of a coarse sensor through") {
  // 90 degrees in 0.2 s: 840 degrees a second at the most.
  test::Motion motion(120, 3);
  for (Eigen::Index t = 0; t < motion.rows(); ++t) {
    const double phase = static_cast<double>(t % 60) / 12.0 - 1.0;  // closes, holds, opens
    const double x = std::clamp(phase < 1.5 ? phase : 3.0 - phase, 0.0, 1.0);
    const double way = 90.0 * x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
    motion.row(t) << way, 1.6 * std::round(way / 1.6), t % 3 == 2 ? motion(t - 1, 0) : way;
  }
  const test::Motion through = gated(motion, 60.0);
  for (Eigen::Index c = 0; c < 3; ++c) {
    INFO("channel " << c);
    CHECK(missing(through.col(c)) == 0);
  }
}

namespace {

// A hand that rests with one degree of noise, and whose angles are then off by `off_rad`, each in
// its frame. How many samples of joints are missing in each frame.
struct Off {
  int frame;
  std::size_t angle;  // of HandAngles
  double off_deg;
};
std::vector<int> hand_gated(double rate_hz, const std::vector<Off>& all) {
  const Skeleton skeleton = hand_skeleton(Side::kRight);
  const auto gate = make_gate(skeleton, rate_hz);
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, kDegree);
  test::Frames out;
  for (int t = 0; t < 90; ++t) {
    HandAngles angles;
    for (double& angle : angles) angle = 0.5 + noise(random);
    for (const Off& off : all) angles[off.angle] += off.frame == t ? off.off_deg * kDegree : 0.0;
    Frame frame;
    set_hand_angles(skeleton, angles, frame);
    frame.header.device_ns = nanoseconds(t / rate_hz);
    gate->process({.frame = frame}, out);
  }
  std::vector<int> missing;
  for (const Frame& frame : out.all) {
    missing.push_back(static_cast<int>(skeleton.joints.size() - frame.valid.count()));
  }
  return missing;
}

constexpr std::size_t kIndex = 9, kMcp = 0, kPip = 3, kDip = 6, kRing = 27;

}  // namespace

TEST_CASE("a finger that bends in two joints is believed, one sensor that jumps is not") {
  // Up and back within three frames, as a flick at 60 Hz.
  std::vector<Off> flick;
  for (const auto& [frame, size] : {std::pair{60, 0.3}, std::pair{61, 1.0}, std::pair{62, 0.3}}) {
    flick.push_back({.frame = frame, .angle = kIndex + kMcp, .off_deg = 60.0 * size});
    flick.push_back({.frame = frame, .angle = kIndex + kPip, .off_deg = 70.0 * size});
  }
  CHECK(std::ranges::max(hand_gated(60.0, flick)) == 0);
  // A glove may make the last joint's angle from the middle one's.
  const std::vector<int> sensor =
      hand_gated(60.0, {{.frame = 60, .angle = kIndex + kPip, .off_deg = 70.0},
                        {.frame = 60, .angle = kIndex + kDip, .off_deg = 45.0}});
  CHECK(sensor[60] == 2);
  CHECK(std::accumulate(sensor.begin(), sensor.end(), 0) == 2);
  // Joints that are off in all directions are no motion.
  std::vector<Off> garbage;
  for (std::size_t finger = 0; finger < 5; ++finger) {
    garbage.push_back({.frame = 60, .angle = 9 * finger + kMcp, .off_deg = 40.0});
    garbage.push_back({.frame = 60, .angle = 9 * finger + kPip, .off_deg = -40.0});
  }
  CHECK(hand_gated(60.0, garbage)[60] == 10);
}

TEST_CASE("after a false value the next one is judged no more kindly") {
  const std::vector<int> missing =
      hand_gated(30.0, {{.frame = 60, .angle = kRing + kPip, .off_deg = 25.0},
                        {.frame = 61, .angle = kRing + kPip, .off_deg = -25.0},
                        {.frame = 63, .angle = kRing + kPip, .off_deg = 60.0}});
  CHECK(missing[60] == 1);
  CHECK(missing[61] == 1);
  CHECK(missing[62] == 0);
  CHECK(missing[63] == 1);
  CHECK(std::accumulate(missing.begin(), missing.end(), 0) == 3);
}

TEST_CASE("a body's joint that flips for a frame is missing in it, and its root stays") {
  Skeleton skeleton;
  skeleton.name = "two joints";
  skeleton.joints.emplace_back().name = "root";
  skeleton.joints.emplace_back().name = "arm";
  skeleton.joints[1].parent = 0;
  skeleton.finish().value();
  const auto gate = make_gate(skeleton, 60.0);
  test::Frames out;
  for (int t = 0; t < 30; ++t) {
    Frame frame;
    frame.skeleton = skeleton.id;
    frame.joint_count = 2;
    frame.valid[0] = frame.valid[1] = true;
    frame.rotation_xyzw[0] = kIdentity;
    const double angle = 0.05 * t + (t == 20 ? 3.0 : 0.0);
    frame.rotation_xyzw[1] = from_eigen(axis_rotation(Axis::kX, angle));
    frame.root_position_m = {0.02F * static_cast<float>(t), 1.0F, t == 25 ? 3.0F : 0.0F};
    frame.header.device_ns = nanoseconds(t / 60.0);
    gate->process({.frame = frame}, out);
  }
  for (std::size_t t = 0; t < out.all.size(); ++t) {
    INFO(t);
    CHECK(out.all[t].valid[1] == (t != 20));
    CHECK(out.all[t].root_position_m[2] == 0.0F);
  }
  CHECK(gate->reading(0) > 0.0);
  CHECK(gate->reading(1) == 1.0);  // the arm
}

TEST_CASE("a flaky connector costs the smoother behind the gate little") {
  const test::SyntheticHand hand = test::synthetic_hand(18, 123);
  const test::Motion clean = test::noisy(hand.angles, 1.0, 5);
  const double without = error_deg(hand.angles, clean, 30.0, 0, 1.0, false);
  CHECK(error_deg(hand.angles, clean, 30.0, 0, 1.0, true) < 1.02 * without);
  const test::Motion bad = spoilt(clean, 0.005, 7);
  CHECK(error_deg(hand.angles, bad, 30.0, 0, 1.0, false) > 1.5 * without);
  CHECK(error_deg(hand.angles, bad, 30.0, 0, 1.0, true) < 1.2 * without);
}

// The figures of models/gate/README.md: `unit_generate "a flaky connector spoils no real grasp"`.
TEST_CASE("a flaky connector spoils no real grasp") {
  const auto folder = test::shared("data/gloves/graspdb14_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  constexpr std::array kFiles{"10_ex01-rad-003-grasp-su04.txt", "01_ex01-rad-002-grasp-su01.txt",
                              "04_ex01-rad-045-grasp-su03.txt"};
  constexpr std::array kShares{std::pair{0.0, 1.01}, std::pair{0.001, 1.1}, std::pair{0.005, 1.1},
                               std::pair{0.02, 1.3}};
  std::ostringstream table;
  for (const int lag : {0, 1, 2}) {
    for (const auto& [share, most] : kShares) {
      double clean_deg = 0.0, bad_deg = 0.0, gated_deg = 0.0;  // squares
      for (const char* const file : kFiles) {
        const test::Motion truth = test::grasp_reference(*folder / file);
        const test::Motion clean = test::noisy(truth, 1.0, 11);
        const test::Motion bad = spoilt(clean, share, 3);
        clean_deg += std::pow(error_deg(truth, clean, 60.0, lag, 1.0, false), 2) / kFiles.size();
        bad_deg += std::pow(error_deg(truth, bad, 60.0, lag, 1.0, false), 2) / kFiles.size();
        gated_deg += std::pow(error_deg(truth, bad, 60.0, lag, 1.0, true), 2) / kFiles.size();
      }
      table << "lag " << lag << ", " << 100 * share << " %: " << std::sqrt(bad_deg) << " -> "
            << std::sqrt(gated_deg) << " (clean " << std::sqrt(clean_deg) << ")\n";
      CHECK(std::sqrt(gated_deg) < most * std::sqrt(clean_deg));
    }
  }
  WARN(table.str());
}

TEST_CASE("what the gate does to a frame takes no microsecond", "[.bench]") {
  const Skeleton skeleton = toy(45);
  const auto gate = make_gate(skeleton, 100.0);
  test::Frames out;
  const Frame frame = test::frame_of(skeleton, Eigen::RowVectorXd::Zero(45), 1, 0);
  struct None final : StageOut {
    void frame(const StageFrame& /*made*/) noexcept override {}
  } none;
  constexpr int kFrames = 100000;
  const double all_us = test::timed_us([&] {
    for (int i = 0; i < kFrames; ++i) gate->process({.frame = frame}, none);
  });
  WARN(1e3 * all_us / kFrames << " ns a frame");
}

}  // namespace posed::gate
