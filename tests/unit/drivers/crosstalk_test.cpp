// Gloves whose sensors show each other's movement, calibrated by poses and by two moves.
#include "drivers/glove/crosstalk.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include <catch2/catch.hpp>

#include "drivers/cyberglove/angles.hpp"
#include "drivers/glove/fit.hpp"
#include "proto/frame/degree.hpp"
#include "tests/support/seeds.hpp"

namespace posed::drivers::glove {
namespace {

using Raw = std::array<float, kMaxSensors>;

constexpr int kJoint2 = 3;  // channels from joint to joint

// A wearer with a glove: its gains and zeros differ from the default's, a bent finger moves the
// sensors of spread beside it, spread fingers move those of their bend, and poses are inexact.
class Wearer {
 public:
  explicit Wearer(unsigned seed) : random_(seed), share_(model_.sensors.size()) {
    for (std::size_t s = 0; s < model_.sensors.size(); ++s) {
      gain_.push_back(1.0 + normal(0.12));
      zero_.push_back(normal(6.0));
      const std::size_t finger = finger_of(s);
      if (finger == 0) continue;
      for (std::size_t other = 0; other < model_.sensors.size(); ++other) {
        const std::size_t beside = finger_of(other);
        if (beside == 0 || std::max(beside, finger) - std::min(beside, finger) > 1) continue;
        if (spreads(s) && !spreads(other)) share_[s].emplace_back(other, normal(0.07));
        if (!spreads(s) && spreads(other)) share_[s].emplace_back(other, normal(0.25));
      }
    }
  }

  // What the glove sends for a hand.
  Raw raw(const HandAngles& hand) {
    const auto value = values_of(model_, hand).value();
    Raw raw{};
    for (std::size_t s = 0; s < value.size(); ++s) {
      double shown = std::isfinite(value[s]) ? value[s] : 0.0;
      for (const auto& [other, share] : share_[s]) shown += share * value[other];
      const Curve& curve = model_.sensors[s].curve;
      const double slope = static_cast<double>(curve.value[1] - curve.value[0]) /
                           static_cast<double>(curve.raw[1] - curve.raw[0]);
      raw[s] = static_cast<float>(
          static_cast<double>(curve.raw[0]) + zero_[s] +
          (shown - static_cast<double>(curve.value[0])) / (slope * gain_[s]) + normal(0.4));
    }
    return raw;
  }

  Recorded poses() {
    Recorded recorded{};
    for (std::size_t p = 0; p < kPoses; ++p) {
      const auto pose = static_cast<Pose>(p);
      const bool flat = first_of(pose) == Pose::kFlat;
      const HandAngles hand = inexact(hand_in(pose), flat ? 1.0 : 3.0);
      for (int i = 0; i < 30; ++i) {
        const Raw sent = raw(hand);
        for (std::size_t s = 0; s < model_.sensors.size(); ++s) recorded[p][s].add(sent[s]);
      }
    }
    return recorded;
  }

  Moves moves() {
    // One finger after the other bends, and draws those beside it along; then all do; twice.
    constexpr int kFrames = 800;
    const auto bends = [](std::size_t f, double turn) {
      const double phase = turn - static_cast<double>(f - 1);
      const bool all = turn > 4.0;
      return all || (phase > 0.0 && phase < 1.0)
                 ? 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * phase)
                 : 0.0;
    };
    Moves moves;
    for (int i = 0; i < kFrames; ++i) {
      const double turn = std::fmod(10.0 * i / kFrames, 5.0);
      HandAngles bent{};
      HandAngles spread{};
      for (std::size_t f = 1; f < kFingers; ++f) {
        double way = bends(f, turn);
        if (f > 1) way = std::max(way, 0.4 * bends(f - 1, turn));
        if (f < 4) way = std::max(way, 0.4 * bends(f + 1, turn));
        bent[f * kFingerChannels] = 80.0 * way * kDegree;
        bent[f * kFingerChannels + kJoint2] = 95.0 * way * kDegree;
        bent[f * kFingerChannels + 1] = 2.0 * std::sin(0.08 * i + static_cast<double>(f)) * kDegree;
        spread[f * kFingerChannels] = 3.0 * std::sin(0.11 * i + static_cast<double>(f)) * kDegree;
        spread[f * kFingerChannels + 1] =
            (f == 2 ? 0.0
                    : 18.0 * (0.5 - 0.5 * std::cos(0.05 * i - 0.15 * static_cast<double>(f)))) *
            kDegree;
      }
      moves.bend.push_back(raw(bent));
      moves.spread.push_back(raw(spread));
    }
    return moves;
  }

  // Mean square of the errors in hands that were never shown, of bends and of spreads.
  std::array<double, 2> errors(const Calibration& calibration) {
    std::array<double, 2> square{};
    for (int i = 0; i < 200; ++i) {
      HandAngles hand{};
      for (std::size_t f = 1; f < kFingers; ++f) {
        hand[f * kFingerChannels] = between(0.0, 80.0) * kDegree;
        hand[f * kFingerChannels + kJoint2] = between(0.0, 100.0) * kDegree;
        hand[f * kFingerChannels + 1] = f == 2 ? 0.0 : between(-5.0, 20.0) * kDegree;
      }
      const Raw sent = raw(hand);
      std::array<Held, kMaxSensors> held{};
      for (std::size_t s = 0; s < model_.sensors.size(); ++s) held[s].add(sent[s]);
      const HandAngles shown = angles_of(model_, calibration, held);
      for (std::size_t f = 1; f < kFingers; ++f) {
        const auto off = [&](std::size_t c) {
          return std::pow(
              (shown[f * kFingerChannels + c] - hand[f * kFingerChannels + c]) / kDegree, 2);
        };
        square[0] += (off(0) + off(kJoint2)) / 2.0 / 800.0;
        square[1] += off(1) / 800.0;
      }
    }
    return square;
  }

  [[nodiscard]] const Model& model() const { return model_; }

 private:
  double normal(double sd) { return std::normal_distribution<double>(0.0, sd)(random_); }
  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  HandAngles inexact(HandAngles hand, double deg) {
    for (std::size_t f = 1; f < kFingers; ++f) {
      for (const std::size_t c : {0, 1, kJoint2}) {
        hand[f * kFingerChannels + c] += normal(c == 1 ? deg / 2.0 : deg) * kDegree;
      }
    }
    return hand;
  }
  [[nodiscard]] bool spreads(std::size_t s) const {
    return model_.sensors[s].name.ends_with("_abd");
  }
  // 0 for sensors of no finger, and of a finger's last joint.
  [[nodiscard]] std::size_t finger_of(std::size_t s) const {
    const std::string& name = model_.sensors[s].name;
    if (!spreads(s) && !name.ends_with("_mcp")) return 0;
    for (std::size_t f = 1; f < kFingers; ++f) {
      if (name.starts_with(kFingerNames[f])) return f;
    }
    return 0;
  }

  Model model_ = cyberglove::glove_model(Side::kRight).value();
  std::mt19937_64 random_;
  std::vector<double> gain_, zero_;
  std::vector<std::vector<std::pair<std::size_t, double>>> share_;
};

}  // namespace

TEST_CASE("two moves take out what sensors show of each other", "[glove]") {
  std::array<double, 2> plain{}, sensors{}, once{}, posed{}, moved{};
  std::array<int, 2> worse{};
  const unsigned wearers = test::few_seeds() ? 4 : 20;
  for (unsigned seed = 1; seed <= wearers; ++seed) {
    Wearer wearer(seed);
    const Model& model = wearer.model();
    CalibrationFile file{.driver = model.driver,
                         .glove = {},
                         .user = "ann",
                         .hand = Side::kRight,
                         .parameters = {},
                         .sensors = {}};
    const Recorded held = wearer.poses();
    CalibrationFile brief = file;
    brief.sensors = fit_poses(model, held).value().sensors;
    CHECK_FALSE(fit_fist(model, held, Side::kRight, brief).value().empty());
    const Recorded poses = with_repeats(held);
    file.sensors = fit_poses(model, poses).value().sensors;
    const auto alone = make_calibration(model, file, Side::kRight, "").value();
    CHECK_FALSE(fit_fist(model, poses, Side::kRight, file).value().empty());
    const auto before = make_calibration(model, file, Side::kRight, "").value();
    const auto said = fit_crosstalk(model, wearer.moves(), Side::kRight, file).value();
    const auto after =
        make_calibration(model, parse_calibration(format_calibration(file), "c.toml").value(),
                         Side::kRight, "")
            .value();
    CHECK_FALSE(said.empty());
    const auto add = [&](std::array<double, 2>& sum, const Calibration& calibration) {
      const auto square = wearer.errors(calibration);
      for (std::size_t i = 0; i < 2; ++i) sum[i] += square[i] / wearers;
      return square;
    };
    const auto by_default = add(plain, *default_calibration(model).value());
    add(sensors, *alone);
    add(once, *make_calibration(model, brief, Side::kRight, "").value());
    const auto by_all = add(posed, *before);
    add(moved, *after);
    for (std::size_t i = 0; i < 2; ++i) worse[i] += by_all[i] > by_default[i] ? 1 : 0;
  }
  const auto text = [](const std::array<double, 2>& square) {
    return std::to_string(std::sqrt(square[0])) + " " + std::to_string(std::sqrt(square[1]));
  };
  INFO("bend, spread [deg]: default " + text(plain) + ", each sensor alone " + text(sensors) +
       ", poses once " + text(once) + ", poses " + text(posed) + ", moves " + text(moved));
  CHECK(worse == std::array{0, 0});  // of the wearers, than by default
  for (std::size_t i = 0; i < 2; ++i) CHECK(posed[i] < once[i]);
  for (std::size_t i = 0; i < 2; ++i) CHECK(moved[i] < std::min(plain[i], posed[i]));
  if (test::few_seeds()) return;  // the limits are those of twenty wearers
  for (const auto& errors : {posed, moved}) {
    CHECK(std::sqrt(errors[0]) < 3.0);
    CHECK(std::sqrt(errors[1]) < 3.5);
  }
}

TEST_CASE("moves that are not made change nothing", "[glove]") {
  Wearer wearer(1);
  CalibrationFile file{.driver = wearer.model().driver,
                       .glove = {},
                       .user = "ann",
                       .hand = Side::kRight,
                       .parameters = {},
                       .sensors = {}};
  file.sensors = fit_poses(wearer.model(), wearer.poses()).value().sensors;
  Moves still;
  for (int i = 0; i < 200; ++i) still.bend.push_back(wearer.raw(HandAngles{}));
  CHECK(fit_crosstalk(wearer.model(), still, Side::kRight, file).value().empty());
  CHECK(file.crosstalk.empty());
}

}  // namespace posed::drivers::glove
