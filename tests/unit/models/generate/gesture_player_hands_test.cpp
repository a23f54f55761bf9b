// The seams of a performance on realistic hands: real grasps led into a sequence of real poses that
// were never recorded as labels, and a synthetic signer with the model of another signer.
#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "models/generate/gesture_player.hpp"
#include "models/gesture/synthetic_signer.hpp"
#include "models/gesture/train.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/grasps.hpp"
#include "tests/support/real_pose_corpus.hpp"
#include "tests/support/shared.hpp"

namespace posed::generate {
namespace {

using What = GesturePlayer::What;
using Hands = std::vector<HandAngles>;

constexpr double kRate_hz = 30.0;

// The largest second difference of any channel around frame t [rad/frame^2].
double acceleration_at(const Hands& hands, std::size_t t) {
  double most = 0.0;
  for (std::size_t c = 0; c < kHandChannels; ++c) {
    most = std::max(most, std::abs(hands[t + 1][c] - 2.0 * hands[t][c] + hands[t - 1][c]));
  }
  return most;
}

double acceleration(const Hands& hands, std::size_t first, std::size_t end) {
  double most = 0.0;
  for (std::size_t t = std::max<std::size_t>(first, 1); t + 1 < std::min(end, hands.size()); ++t) {
    most = std::max(most, acceleration_at(hands, t));
  }
  return most;
}

// Performs the sequence from that frame of the live hand on and checks that the acceleration at the
// three seams is at most the larger of the performance's and the live hand's own largest
// acceleration.
void check_seams(const gesture::GestureModel& trained, const Hands& live, std::size_t start) {
  const auto model = bind_model(trained, hand_skeleton(Side::kRight), kRate_hz, "test").value();
  const auto order =
      gesture::make_play_order(model->gesture(), gesture::split_labels("g 1 c 3 4 p"), 1.0, false)
          .value();
  GesturePlayer player(kRate_hz, kHandChannels);
  player.set_model(model.get());
  Hands shown;
  std::size_t back = 0;
  for (std::size_t t = 0; t == 0 || t <= start || player.busy(); ++t) {
    if (t == start) REQUIRE(player.play(order));
    const GesturePlayer::Pose pose = player.step(live[t % live.size()]);
    if (back == 0 && pose.what == What::kLeadingBack) back = t;
    std::ranges::copy(pose.angles, shown.emplace_back().begin());
    REQUIRE(t < 10'000);
  }
  const auto lead = static_cast<std::size_t>(0.8 * kRate_hz) + 1;
  const double own =
      std::max(acceleration(shown, start + lead, back - 2), acceleration(live, 0, live.size()));
  const double in = acceleration(shown, start - 2, start + 2);
  const double out = acceleration(shown, back - 2, back + 2);
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  WARN("seam in " << in * kDegrees << ", back " << out * kDegrees << ", own " << own * kDegrees
                  << " deg/frame^2");
  CHECK(in <= own);
  CHECK(out <= own);
}

// The moments of models/generate/README.md, "Blending measured": the fastest frame, a fast one, and
// two others.
std::vector<std::size_t> moments(const Hands& live) {
  std::vector<std::pair<double, std::size_t>> speeds;
  for (std::size_t t = 3; t + 3 < live.size(); ++t) {
    double most = 0.0;
    for (std::size_t c = 0; c < kHandChannels; ++c) {
      most = std::max(most, std::abs(live[t][c] - live[t - 1][c]));
    }
    speeds.emplace_back(most, t);
  }
  std::ranges::sort(speeds);
  return {speeds.back().second, speeds[speeds.size() - 40].second, live.size() / 3,
          live.size() / 2};
}

}  // namespace

TEST_CASE("real hands are led into real poses and back without a snap", "[playback]") {
  const auto poses = test::shared("data/gloves/libras_cyberglove");
  const auto grasps =
      test::shared("data/gloves/graspdb14_cyberglove/10_ex01-rad-003-grasp-su04.txt");
  if (!poses || !grasps) SKIP_WITHOUT_SHARED();
  const auto model = gesture::train_gesture({test::real_pose_corpus(*poses, 7)}, {});
  REQUIRE(model);
  // The sensors are used as flexions, because only their motion matters here.
  const test::Motion motion = test::grasp_reference(*grasps);
  Hands live;
  for (Eigen::Index t = 0; t < motion.rows(); t += 2) {
    HandAngles angles{};
    for (int j = 0; j < kHandJoints; ++j) {
      angles[static_cast<std::size_t>(3 * j)] = motion(t, j) * kDegree;
    }
    live.push_back(angles);
  }
  for (const std::size_t start : moments(live)) check_seams(*model, live, start);
}

TEST_CASE("a signer is led into another's gestures and back without a snap", "[playback]") {
  const auto teacher = gesture::make_performance({.person = 1, .gestures = 40}).value();
  auto recording = gesture::recording_of(teacher.clip, kRate_hz);
  REQUIRE(recording);
  REQUIRE(gesture::cut(*recording, teacher.labels, "teacher.lab"));
  const auto model = gesture::train_gesture({*recording}, {});
  REQUIRE(model);
  const auto other = gesture::make_performance(
                         {.person = 9, .gestures = 12, .noise_deg = 0.0, .dead_band_deg = 0.0})
                         .value();
  for (const std::size_t start : moments(other.clip.angles)) {
    check_seams(*model, other.clip.angles, start);
  }
}

}  // namespace posed::generate
