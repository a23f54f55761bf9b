// The constraint stage: the fixture's optimum, and properties that hold for any input.
#include "models/hand/constraint_solver.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/allocations.hpp"
#include "tests/support/golden_json.hpp"
#include "tests/support/processor_time.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/models/hand/hand_poses.hpp"

namespace posed::hand {
namespace {

constexpr double kCentimetre = 0.01;

// The fixture's two fingers along x, spread about z before they flex about y, as two of our five
// fingers: its x, y, z are our z, x, y; the spread is the z channel of the first joint in a frame
// whose z axis is our y. The other three fingers are far away.
HandGeometry fixture_hand(const nlohmann::json& fixture) {
  HandGeometry hand;
  for (int f = 0; f < kFingers; ++f) {
    FingerGeometry& finger = hand.fingers[static_cast<std::size_t>(f)];
    finger.base_m = f < 2 ? Eigen::Vector3d(fixture["base"][f][1].get<double>() * kCentimetre, 0, 0)
                          : Eigen::Vector3d(f, 0, 0);
    finger.root.col(0) = Eigen::Vector3d::UnitX();
    finger.root.col(1) = -Eigen::Vector3d::UnitZ();
    finger.root.col(2) = Eigen::Vector3d::UnitY();
    finger.along = finger.root.transpose() * Eigen::Vector3d::UnitZ();
    for (std::size_t j = 0; j < 3; ++j) {
      finger.length_m[j] = fixture["lengths"][j].get<double>() * kCentimetre;
      finger.radius_m[j] = fixture["radius"].get<double>() * kCentimetre;
    }
  }
  return hand;
}

// The channel of the fixture's variable k of a finger: spread, then three flexions.
std::size_t channel(int finger, std::size_t k) {
  return k == 0 ? test::angle(finger, 0, 2) : test::angle(finger, static_cast<int>(k) - 1, 0);
}

double cost(const HandAngles& a, const HandAngles& b) {
  double sum = 0.0;
  for (std::size_t c = 0; c < a.size(); ++c) sum += (a[c] - b[c]) * (a[c] - b[c]);
  return sum;
}

}  // namespace

TEST_CASE("the nearest pose of the fixture's fingers is found") {
  const auto fixture = test::golden_json("constraint.json");
  HandGeometry hand = fixture_hand(fixture);
  HandAngles variance;
  variance.fill(1e-9);
  for (int f = 0; f < 2; ++f) {
    for (std::size_t k = 0; k < 4; ++k) {
      variance[channel(f, k)] = 1.0;
      hand.low_rad[channel(f, k)] = fixture["limits"][0][k].get<double>();
      hand.high_rad[channel(f, k)] = fixture["limits"][1][k].get<double>();
    }
  }
  REQUIRE(fixture["cases"].size() == 10);
  for (const auto& one : fixture["cases"]) {
    HandAngles target{};
    for (std::size_t k = 0; k < 8; ++k) {
      target[channel(static_cast<int>(k / 4), k % 4)] = one["x0"][k].get<double>();
    }
    CHECK(min_gap_m(hand, target) / kCentimetre ==
          Approx(one["penetration"].get<double>()).margin(1e-9));

    ConstraintSolver solver(hand, {.soft_limits = false, .margin_m = 0.0});
    HandAngles angles = target;
    const ConstraintReport report = solver.step(angles, variance);
    CHECK_FALSE(report.retreated);
    CHECK(report.min_gap_m / kCentimetre >= -1e-3);
    CHECK(cost(angles, target) <= 1.02 * one["cost"].get<double>());
  }
}

TEST_CASE("the gap is at least zero from any finite input, and limits hold") {
  const HandGeometry hand = hand_geometry(default_hand_shape());
  ConstraintSolver solver;
  std::mt19937 random(11);
  int retreats = 0;
  for (int i = 0; i < 3000; ++i) {
    const double most_rad = i % 3 == 0 ? 0.6 : i % 3 == 1 ? 1.5 : 1e6;
    HandAngles angles = i == 0 ? test::crossed() : test::any_angles(random, most_rad);
    const ConstraintReport report = solver.step(angles, test::same_variance());
    retreats += report.retreated ? 1 : 0;
    const bool good =
        report.min_gap_m >= 0.0 && min_gap_m(hand, angles) >= 0.0 && !report.left_alone;
    if (!good) FAIL("input " << i << ": gap " << min_gap_m(hand, angles));
    for (std::size_t c = 0; c < angles.size(); ++c) {
      if (angles[c] < hand.low_rad[c] - 1e-9 || angles[c] > hand.high_rad[c] + 1e-9) {
        FAIL("input " << i << ": angle " << c << " is " << angles[c]);
      }
    }
  }
  WARN("straightened in " << retreats << " of 3000 random poses");
}

TEST_CASE("a pose with gaps inside the limits is unchanged to the bit") {
  ConstraintSolver solver;
  HandAngles angles{};
  angles[test::angle(1, 1, 0)] = 0.7;
  const HandAngles before = angles;
  const ConstraintReport report = solver.step(angles, test::same_variance());
  CHECK(angles == before);
  CHECK(report.touching == 0);
  CHECK(report.changed_rad == 0.0);
}

TEST_CASE("an angle that is not finite leaves the pose unchanged, and is reported") {
  ConstraintSolver solver;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    HandAngles angles = test::crossed();
    angles[20] = bad;
    const HandAngles before = angles;
    const ConstraintReport report = solver.step(angles, test::same_variance());
    CHECK(report.left_alone);
    for (std::size_t c = 0; c < angles.size(); ++c) {
      if (c != 20) CHECK(angles[c] == before[c]);
    }
  }
  HandAngles angles = test::crossed();
  HandAngles variance = test::same_variance();
  variance[3] = -1.0;
  variance[4] = std::numeric_limits<double>::quiet_NaN();
  variance[5] = 0.0;
  CHECK(solver.step(angles, variance).min_gap_m >= 0.0);
}

TEST_CASE("the finger with the larger variance moves") {
  HandAngles crossing{};
  crossing[test::angle(1, 0, 1)] = -15 * kDegree;  // the index finger into the middle finger
  const auto moved = [&](int uncertain) {
    HandAngles variance;
    variance.fill(1e-4);
    for (int c = 0; c < kFingerChannels; ++c) {
      variance[static_cast<std::size_t>(kFingerChannels * uncertain + c)] = 1e-2;
    }
    HandAngles angles = crossing;
    ConstraintSolver solver;
    CHECK(solver.step(angles, variance).min_gap_m >= 0.0);
    std::array<double, kFingers> by{};
    for (std::size_t c = 0; c < angles.size(); ++c) {
      by[c / kFingerChannels] += std::abs(angles[c] - crossing[c]);
    }
    return by;
  };
  CHECK(moved(1)[1] > 5 * moved(1)[2]);
  CHECK(moved(2)[2] > 5 * moved(2)[1]);
}

TEST_CASE("a finger that slides into another moves the pose without a jump") {
  ConstraintSolver solver;
  HandAngles before{};
  double most_rad = 0.0;
  constexpr int kFrames = 200;
  for (int i = 0; i < kFrames; ++i) {
    HandAngles angles{};
    angles[test::angle(1, 0, 1)] = -12 * kDegree * std::sin(0.05 * i);
    angles[test::angle(1, 0, 0)] = 0.2;
    (void)solver.step(angles, test::same_variance());
    if (i > 0) {
      for (std::size_t c = 0; c < angles.size(); ++c) {
        most_rad = std::max(most_rad, std::abs(angles[c] - before[c]));
      }
    }
    before = angles;
  }
  CHECK(most_rad < 1.5 * 12 * kDegree * 0.05);
}

TEST_CASE("the constraint stage does not allocate, and gives the same bits again") {
  ConstraintSolver one, other;
  std::mt19937 random(2);
  for (int i = 0; i < 50; ++i) {
    const HandAngles input = i == 0 ? test::crossed() : test::any_angles(random, 0.8);
    HandAngles a = input;
    HandAngles b = input;
    const std::uint64_t taken = test::allocations();
    (void)one.step(a, test::same_variance());
    CHECK(test::allocations() == taken);
    (void)other.step(b, test::same_variance());
    CHECK(a == b);
  }
}

TEST_CASE("the processor time of a step", "[.bench]") {
  std::mt19937 random(4);
  for (const double most_rad : {0.0, 0.25, 0.6}) {
    ConstraintSolver solver;
    std::vector<double> took_us;
    HandAngles centre = test::any_angles(random, most_rad);
    for (int i = 0; i < 20000; ++i) {
      HandAngles angles = centre;
      for (std::size_t c = 0; c < angles.size(); ++c) {
        angles[c] += most_rad * 0.3 * std::sin(0.03 * i + static_cast<double>(c));
      }
      const double begin_us = test::processor_time_us();
      (void)solver.step(angles, test::same_variance());
      took_us.push_back(test::processor_time_us() - begin_us);
    }
    std::ranges::sort(took_us);
    const auto at = [&](double p) { return took_us[static_cast<std::size_t>(p * 19999)]; };
    WARN("angles within " << most_rad << ": p50 " << at(0.5) << " p99 " << at(0.99) << " p99.9 "
                          << at(0.999) << " max " << at(1.0) << " us of processor time");
  }
}

}  // namespace posed::hand
