// A performance on a live hand: it leads in and back without a jump, keeps its duration, and
// accepts new labels while it plays.
#include "models/generate/gesture_player.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include <catch2/catch.hpp>

#include "proto/frame/hand_skeleton.hpp"
#include "tests/support/allocations.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"

namespace posed::generate {
namespace {

using What = GesturePlayer::What;

constexpr std::span<const double> kNoHand;

struct Shown {
  HandAngles angles;
  What what;
  int label;
};

std::unique_ptr<const BoundModel> toy(double rate_hz) {
  return bind_model(test::toy_gesture_model(), hand_skeleton(Side::kRight), rate_hz, "toy").value();
}

gesture::PlayOrder order(const BoundModel& model, const std::string& labels, double tempo = 1.0,
                         bool loop = false) {
  return gesture::make_play_order(model.gesture(), gesture::split_labels(labels), tempo, loop)
      .value();
}

// A fast hand that opens and closes: minimum-jerk moves of 0.3 s with rests between, fingers one
// after the other.
HandAngles live_hand(double time_s) {
  constexpr double kPeriod_s = 1.2, kMove_s = 0.3;
  const auto moved = [](double since_s) {
    const double t = std::clamp(since_s / kMove_s, 0.0, 1.0);
    return t * t * t * (10.0 - t * (15.0 - 6.0 * t));
  };
  HandAngles angles{};
  for (std::size_t c = 0; c < angles.size(); c += 3) {
    const double phase_s = std::fmod(time_s + 0.02 * double(c), kPeriod_s);
    angles[c] = 0.1 + 1.2 * (moved(phase_s) - moved(phase_s - kPeriod_s / 2));
  }
  return angles;
}

// Runs `before` frames, plays until the player is idle again, and runs `before` frames more. `live`
// false: without a live hand.
std::vector<Shown> perform(GesturePlayer& player, const gesture::PlayOrder& what, double rate_hz,
                           bool live = true, int before = 40) {
  std::vector<Shown> shown;
  const auto step = [&] {
    const HandAngles hand = live_hand(double(shown.size()) / rate_hz);
    const auto pose = player.step(live ? std::span<const double>(hand) : kNoHand);
    shown.push_back({.angles = {}, .what = pose.what, .label = pose.label});
    std::ranges::copy(pose.angles, shown.back().angles.begin());
  };
  for (int i = 0; i < before; ++i) step();
  REQUIRE(player.play(what));
  while (player.busy()) {
    step();
    REQUIRE(shown.size() < 100'000);
  }
  for (int i = 0; i < before; ++i) step();
  return shown;
}

// The largest second difference of any channel over frames [first, end) [rad/frame^2].
double acceleration(const std::vector<Shown>& shown, std::size_t first, std::size_t end) {
  double most = 0.0;
  for (std::size_t t = std::max<std::size_t>(first, 1); t + 1 < std::min(end, shown.size()); ++t) {
    for (std::size_t c = 0; c < kHandChannels; ++c) {
      most = std::max(most, std::abs(shown[t + 1].angles[c] - 2.0 * shown[t].angles[c] +
                                     shown[t - 1].angles[c]));
    }
  }
  return most;
}

std::size_t first_of(const std::vector<Shown>& shown, What what) {
  std::size_t t = 0;
  while (t < shown.size() && shown[t].what != what) ++t;
  return t;
}

std::size_t count_of(const std::vector<Shown>& shown, What what) {
  return std::size_t(std::ranges::count(shown, what, &Shown::what));
}

}  // namespace

TEST_CASE("a performance begins and ends on a live hand without a jump", "[playback]") {
  for (const double rate_hz : {30.0, 60.0, 120.0}) {
    for (const int before : {40, 47, 55}) {  // different moments of the live hand
      const auto model = toy(rate_hz);
      GesturePlayer player(rate_hz, kHandChannels);
      player.set_model(model.get());
      const auto shown = perform(player, order(*model, "g 1 c 3 4 p"), rate_hz, true, before);
      const std::size_t begin = first_of(shown, What::kPerformed);
      const std::size_t back = first_of(shown, What::kLeadingBack);
      const std::size_t idle = back + count_of(shown, What::kLeadingBack);
      CHECK(begin == std::size_t(before));
      const auto lead = std::size_t(rate_hz);  // longer than any lead-in
      const double own =
          std::max(acceleration(shown, begin + lead, back - 2), acceleration(shown, 0, begin));
      INFO(rate_hz << " Hz, after " << before);
      // The hand itself sometimes has its largest acceleration at a seam; the blend adds to that.
      for (const std::size_t seam : {begin, back, idle}) {
        CHECK(acceleration(shown, seam - 2, seam + 2) <= 1.15 * own);
      }
      CHECK(acceleration(shown, begin, begin + lead) <= 1.25 * own);
      CHECK(acceleration(shown, back, idle) <= 1.25 * own);
      CHECK(shown.back().what == What::kLive);
      const HandAngles hand = live_hand(double(shown.size() - 1) / rate_hz);
      CHECK(shown.back().angles == hand);
    }
  }
}

TEST_CASE("each label is reached, in order, and a model of 30 Hz is right at other rates",
          "[playback]") {
  std::vector<double> seconds_of;
  for (const double rate_hz : {30.0, 60.0, 120.0}) {
    const auto model = toy(rate_hz);
    GesturePlayer player(rate_hz, kHandChannels);
    player.set_model(model.get());
    const auto shown = perform(player, order(*model, "g p 1"), rate_hz);
    std::vector<std::pair<int, double>> middle;  // index flexion in the middle of each label
    for (std::size_t t = first_of(shown, What::kPerformed); shown[t].what == What::kPerformed;) {
      std::size_t end = t;
      while (shown[end].what == What::kPerformed && shown[end].label == shown[t].label) ++end;
      middle.emplace_back(shown[t].label, shown[(t + end) / 2].angles[kFingerChannels]);
      t = end;
    }
    REQUIRE(middle.size() == 3);
    CHECK(model->gesture().labels[std::size_t(middle[1].first)].name == "p");
    CHECK(middle[0].second == Approx(test::toy_flexion(1, 0, 0)).margin(0.05));
    CHECK(middle[1].second == Approx(test::toy_flexion(1, 0, 2)).margin(0.05));
    CHECK(middle[2].second == Approx(test::toy_flexion(1, 0, 2)).margin(0.05));
    seconds_of.push_back(double(count_of(shown, What::kPerformed)) / rate_hz);
  }
  CHECK(seconds_of[1] == Approx(seconds_of[0]).epsilon(0.02));
  CHECK(seconds_of[2] == Approx(seconds_of[0]).epsilon(0.02));
}

TEST_CASE("the tempo divides a performance's length", "[playback]") {
  const double rate_hz = 30.0;
  const auto model = toy(rate_hz);
  const auto frames = [&](double tempo) {
    GesturePlayer player(rate_hz, kHandChannels);
    player.set_model(model.get());
    const auto shown = perform(player, order(*model, "g 1 c 3 4 p", tempo), rate_hz, false, 0);
    // The lead-in is the same at any tempo: it goes from a flat hand to the first label.
    constexpr double kMaxDistance_rad = 1.3, kLeadSpeed_rad_s = 300.0 * std::numbers::pi / 180.0;
    const double lead = std::ceil(rate_hz * 1.5 * kMaxDistance_rad / kLeadSpeed_rad_s);
    return double(count_of(shown, What::kPerformed)) - lead;
  };
  const double natural = frames(1.0);
  for (const double tempo : {0.5, 0.75, 1.5, 2.0}) {
    INFO("tempo " << tempo);
    CHECK(frames(tempo) == Approx(natural / tempo).epsilon(0.05));
  }
}

TEST_CASE("labels appended while it plays are performed after the earlier ones", "[playback]") {
  const auto model = toy(30.0);
  GesturePlayer player(30.0, kHandChannels);
  player.set_model(model.get());
  REQUIRE(player.play(order(*model, "g")));
  std::vector<int> labels;
  HandAngles before{};
  double most_step = 0.0;
  for (int t = 0; player.busy(); ++t) {
    if (t == 80) REQUIRE(player.play(order(*model, "p c")));
    const GesturePlayer::Pose pose = player.step(kNoHand);
    if (pose.what == What::kPerformed && (labels.empty() || labels.back() != pose.label)) {
      labels.push_back(pose.label);
    }
    for (std::size_t c = 0; c < kHandChannels; ++c) {
      most_step = std::max(most_step, std::abs(pose.angles[c] - before[c]));
    }
    std::ranges::copy(pose.angles, before.begin());
    REQUIRE(t < 10'000);
  }
  CHECK(labels == std::vector<int>{0, 2, 1});
  CHECK(most_step < 0.35);  // 600 degrees a second
  CHECK(player.step(kNoHand).what == What::kHeld);
}

TEST_CASE("a loop continues until other labels are played; stop leads back at once", "[playback]") {
  const auto model = toy(30.0);
  GesturePlayer player(30.0, kHandChannels);
  player.set_model(model.get());
  REQUIRE(player.play(order(*model, "g p", 2.0, true)));
  for (int t = 0; t < 2000; ++t) CHECK(player.step(kNoHand).what == What::kPerformed);
  REQUIRE(player.play(order(*model, "c")));
  int t = 0;
  while (player.busy() && t < 1000) {
    static_cast<void>(player.step(kNoHand));
    ++t;
  }
  CHECK(t < 300);
  REQUIRE(player.play(order(*model, "g p g p g p")));
  for (int i = 0; i < 60; ++i) static_cast<void>(player.step(kNoHand));
  player.stop();
  for (int i = 0; i < 24; ++i) CHECK(player.step(kNoHand).what == What::kLeadingBack);
  CHECK(player.step(kNoHand).what == What::kHeld);
}

TEST_CASE("what cannot be performed is refused", "[playback]") {
  const auto model = toy(30.0);
  GesturePlayer player(30.0, kHandChannels);
  const auto one = order(*model, "g");
  CHECK_FALSE(player.play(one));  // no model
  player.set_model(model.get());
  auto unknown = one;
  unknown.label[0] = 6;
  CHECK_FALSE(player.play(unknown));
  CHECK_FALSE(player.play(gesture::PlayOrder{}));
  std::string many;
  for (int i = 0; i < gesture::kMaxLabels; ++i) many += "g ";
  for (int i = 0; i < 4; ++i) CHECK(player.play(order(*model, many)));
  CHECK_FALSE(player.play(one));  // too many labels
  CHECK(gesture::make_play_order(model->gesture(), gesture::split_labels("g x"), 1.0, false)
            .error()
            .message.find("does not know the label 'x'; it knows: g c p 1 3 4") !=
        std::string::npos);
}

TEST_CASE("a performance allocates nothing", "[playback]") {
  const auto model = toy(120.0);
  const auto other = toy(120.0);
  GesturePlayer player(120.0, kHandChannels);
  player.set_model(model.get());
  const auto what = order(*model, "g 1 c", 1.5, true);
  const auto before = test::allocations();
  for (int t = 0; t < 3000; ++t) {
    const HandAngles hand = live_hand(t / 120.0);
    if (t % 700 == 100) static_cast<void>(player.play(what));
    if (t % 900 == 600) player.stop();
    if (t == 2000) player.set_model(other.get());
    static_cast<void>(player.step(hand));
  }
  CHECK(test::allocations() == before);
}

}  // namespace posed::generate
