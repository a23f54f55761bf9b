// Where the speed may change and where it does not (models/smooth/README.md, "Steady motion").
#include "models/smooth/steady_motion.hpp"

#include <functional>
#include <limits>
#include <random>

#include <catch2/catch.hpp>

#include "proto/frame/degree.hpp"
#include "tests/support/allocations.hpp"

using namespace posed;

namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();
constexpr int kFollowed = 8;  // channels
constexpr int kRemembered = 40;
constexpr double kNoise = 1.0 * kDegree;

// Channels that are measured with noise at 60 Hz.
class Follower {
 public:
  // truth(channel, time): degrees.
  explicit Follower(std::function<double(int, double)> truth) : truth_(std::move(truth)) {}

  void go_on(double until_s) {
    for (; frame_ < until_s * 60.0; ++frame_) {
      const double now_s = static_cast<double>(frame_) / 60.0;
      for (int c = 0; c < kFollowed; ++c) {
        measured_[static_cast<std::size_t>(c)] =
            truth_(c, now_s) * kDegree + kNoise * normal_(random_);
      }
      const auto before = test::allocations();
      motion.push(
          now_s, measured_,
          {.variance_rad2 = variance.data(), .density = density.data(), .active = active.data()});
      if (test::allocations() != before) FAIL("push takes memory");
    }
  }
  [[nodiscard]] double mean_loose(int back) const {
    double sum = 0.0;
    for (int c = 0; c < kFollowed; ++c) sum += motion.loose(back)[c];
    return sum / kFollowed;
  }

  smooth::SteadyMotion motion{kFollowed, kFollowed, kRemembered};
  // As the speed-adaptive prior expects of some 10 deg/s.
  std::vector<double> density = std::vector<double>(kFollowed, 2000.0 * kDegree * kDegree);
  std::vector<double> active = std::vector<double>(kFollowed, 1.0);
  std::vector<double> variance = std::vector<double>(kFollowed, kNoise* kNoise);

 private:
  std::function<double(int, double)> truth_;
  std::vector<double> measured_ = std::vector<double>(kFollowed);
  std::mt19937_64 random_{5};
  std::normal_distribution<double> normal_;
  int frame_ = 0;
};

}  // namespace

TEST_CASE("rest and steady ramps are told from turns", "[live]") {
  const double speed = GENERATE(0.0, 5.0, 60.0);
  Follower hand([speed](int, double t) { return speed * t + (t > 2.0 ? 120.0 * (t - 2.0) : 0.0); });
  hand.go_on(2.0);
  CHECK(hand.mean_loose(0) < 0.15);
  CHECK(hand.mean_loose(20) < 0.3);
  hand.go_on(2.0 + 10.0 / 60.0);
  CHECK(hand.mean_loose(0) > 0.9);
  // The change is known where it took place, and not long before.
  CHECK(hand.mean_loose(9) > 0.9);
  CHECK(hand.mean_loose(20) < 0.3);
  hand.go_on(4.5);
  CHECK(hand.mean_loose(0) < 0.15);
}

TEST_CASE("channels that move together help one another to notice it", "[live]") {
  const auto starts = [](int c, double t) { return t > 2.0 && c > 0 ? 60.0 * (t - 2.0) : 0.0; };
  Follower together(starts);
  Follower apart(starts);
  for (std::size_t c = 1; c < kFollowed; ++c) apart.active[c] = 0.0;
  for (Follower* hand : {&together, &apart}) hand->go_on(2.0 + 9.0 / 60.0);
  CHECK(apart.motion.loose(0)[0] < 0.3);
  CHECK(together.motion.loose(0)[0] > 0.9);
}

TEST_CASE("a missing value is as loose as the speed wants, and no channel is lost", "[live]") {
  Follower hand([](int c, double t) {
    if (c == 0) return kMissing;
    if (c == 1 && t < 1.0) return kMissing;
    if (c == 2 && t > 1.0 && t < 2.0) return kMissing;
    return 5.0 * t;
  });
  hand.go_on(1.5);
  CHECK(hand.motion.loose(0)[0] == 1.0);
  CHECK(hand.motion.loose(0)[2] == 1.0);
  CHECK(hand.motion.loose(0)[1] < 1.0);
  CHECK(hand.motion.loose(0)[3] < 0.3);
  hand.go_on(3.5);
  CHECK(hand.motion.loose(0)[0] == 1.0);
  for (int c = 1; c < kFollowed; ++c) CHECK(hand.motion.loose(0)[c] < 0.3);
}

TEST_CASE("steady motion is forgotten completely", "[live]") {
  const auto ramp = [](int, double t) { return 5.0 * t; };
  Follower once(ramp);
  Follower again(ramp);
  once.go_on(1.0);
  again.motion.push(0.0, std::vector<double>(kFollowed, 2.0),
                    {.variance_rad2 = again.variance.data(),
                     .density = again.density.data(),
                     .active = again.active.data()});
  again.motion.reset();
  again.go_on(1.0);
  for (int c = 0; c < kFollowed; ++c) CHECK(once.motion.loose(3)[c] == again.motion.loose(3)[c]);
}
