// Whether recorded poses are good enough for a calibration.
#include "drivers/glove/pose_check.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <random>
#include <string>

#include "drivers/driver.hpp"
#include "drivers/glove/angle_map.hpp"
#include "drivers/glove/calibration.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/traits.hpp"
#include "proto/frame/degree.hpp"

namespace posed::drivers::glove {
namespace {

Model model_of(const std::string& name) {
  const Driver* driver = find_driver(name);
  return driver->glove->glove_model(driver->expect({}).value()).value();
}
Model cyberglove() { return model_of("cyberglove"); }

// The raw value that the default calibration maps to `value`.
double raw_of(const Sensor& sensor, double value) {
  double best = sensor.raw_min;
  for (double raw = sensor.raw_min; raw <= sensor.raw_max; ++raw) {
    const auto at = [&](double r) {
      return std::abs(static_cast<double>(sensor.curve.value_at(static_cast<float>(r))) - value);
    };
    if (at(raw) < at(best)) best = raw;
  }
  return best;
}

// All four poses, held for 200 samples with a sway of `unrest` counts.
Recorded held(const Model& model, double unrest = 0.5) {
  Recorded recorded{};
  for (std::size_t p = 0; p < kPoses; ++p) {
    const auto wanted = values_of(model, hand_in(static_cast<Pose>(p))).value();
    for (std::size_t i = 0; i < model.sensors.size(); ++i) {
      if (!std::isfinite(wanted[i])) continue;
      const double raw = raw_of(model.sensors[i], wanted[i]);
      for (int t = 0; t < 200; ++t) {
        recorded[p][i].add(static_cast<float>(raw + unrest * std::sin(0.1 * t)));
      }
    }
  }
  return recorded;
}

}  // namespace

TEST_CASE("poses held still are good, and the verdict says how still") {
  const Model model = cyberglove();
  const auto check = check_poses(model, held(model)).value();
  INFO(check.verdict());
  CHECK(check.usable());
  CHECK(check.poses.size() == kPoses);
  CHECK(check.verdict().starts_with("good: the hand was still in every pose"));
}

TEST_CASE("the verdict on good poses names a sensor that was less still") {
  const Model model = cyberglove();
  Recorded recorded = held(model);
  const auto fist = static_cast<std::size_t>(Pose::kFist);
  const Recorded restless = held(model, 60.0);
  const auto sensors = poses_of_sensors(model, recorded).value();
  const auto one = std::ranges::find(sensors, Pose::kFist, &SensorPoses::pose);
  REQUIRE(one != sensors.end());
  recorded[fist][one->sensor] = restless[fist][one->sensor];
  const auto check = check_poses(model, recorded).value();
  INFO(check.verdict());
  CHECK(check.usable());
  CHECK(check.verdict().ends_with("; less still: " + model.sensors[one->sensor].name));
}

TEST_CASE("a hand that moved in every pose fails every pose") {
  const Model model = cyberglove();
  const auto check = check_poses(model, held(model, 60.0)).value();
  INFO(check.verdict());
  CHECK_FALSE(check.usable());
  CHECK(check.failed().size() == kPoses);
  CHECK(check.verdict().contains("moved while it was held"));
}

TEST_CASE("a hand that moved in one pose fails that one: hold it again") {
  const Model model = cyberglove();
  Recorded recorded = held(model);
  recorded[static_cast<std::size_t>(Pose::kThumb)] =
      held(model, 60.0)[static_cast<std::size_t>(Pose::kThumb)];
  const auto check = check_poses(model, recorded).value();
  INFO(check.verdict());
  CHECK(check.failed() == std::vector{Pose::kThumb});
  CHECK(check.verdict().starts_with("thumb failed: "));
  CHECK(check.verdict().ends_with(": hold it again"));
}

TEST_CASE("one sensor that hardly moved is a broken sensor, many are a pose that was not taken") {
  const Model model = cyberglove();
  const auto with_stuck = [&](std::size_t many) {
    Recorded recorded = held(model);
    std::size_t stuck = 0;
    const auto rests = poses_of_sensors(model, recorded).value();
    for (const SensorPoses& at : rests) {
      if (at.pose != Pose::kFist || stuck == many) continue;
      for (auto& pose : recorded) pose[at.sensor] = recorded[0][at.sensor];
      ++stuck;
    }
    REQUIRE(stuck == many);
    return check_poses(model, recorded).value();
  };
  CHECK(with_stuck(1).usable());
  const auto check = with_stuck(7);
  INFO(check.verdict());
  CHECK(check.failed() == std::vector{Pose::kFist});
  CHECK(check.verdict().contains("hardly moved from the flat hand"));
}

namespace {

using Hands = std::array<HandAngles, kPoses>;

Hands exact_hands() {
  Hands hands;
  for (std::size_t p = 0; p < hands.size(); ++p) hands[p] = hand_in(static_cast<Pose>(p));
  return hands;
}

// The hand between flat and fist.
HandAngles part_of_fist(double share) {
  HandAngles hand = hand_in(Pose::kFist);
  for (double& angle : hand) angle *= share;
  return hand;
}

// What a glove sends whose sensors move `gain` times as much as the default's.
Recorded sent(const Model& model, const Hands& hands, const std::vector<double>& gain) {
  Recorded recorded{};
  for (std::size_t p = 0; p < hands.size(); ++p) {
    const auto wanted = values_of(model, hands[p]).value();
    for (std::size_t i = 0; i < model.sensors.size(); ++i) {
      if (!std::isfinite(wanted[i])) continue;
      const Curve& curve = model.sensors[i].curve;
      const double slope = static_cast<double>(curve.raw[1] - curve.raw[0]) /
                           static_cast<double>(curve.value[1] - curve.value[0]);
      const double raw = static_cast<double>(curve.raw[0]) + gain[i] * slope * wanted[i];
      for (int t = 0; t < 20; ++t) {
        recorded[p][i].add(static_cast<float>(raw + 0.5 * std::sin(t)));
      }
    }
  }
  return recorded;
}

// As people hold them.
template <typename Normal>
Hands inexact_hands(const Normal& normal) {
  Hands hands = exact_hands();
  for (std::size_t p = 0; p < hands.size(); ++p) {
    const bool flat = first_of(static_cast<Pose>(p)) == Pose::kFlat;
    for (std::size_t f = 0; f < kFingers; ++f) {
      for (const std::size_t joint : {0, 3, 6}) {
        hands[p][f * kFingerChannels + joint] += normal(flat ? 1.6 : 5.0) * kDegree;
      }
      hands[p][f * kFingerChannels + 1] += normal(flat ? 1.0 : 2.5) * kDegree;
    }
  }
  return hands;
}

PoseCheck checked(const Model& model, const Hands& hands, double gain = 1.0) {
  const std::vector<double> gains(model.sensors.size(), gain);
  return check_poses(model, sent(model, hands, gains)).value();
}

}  // namespace

TEST_CASE("another hand than the pose's fails the pose, in words") {
  for (const std::string name : {"cyberglove", "lucidgloves", "fivedt"}) {
    const Model model = model_of(name);
    INFO(name);
    Hands swapped = exact_hands();
    std::swap(swapped[0], swapped[1]);
    const auto other = checked(model, swapped);
    CHECK(other.failed() == std::vector{Pose::kFlat, Pose::kFist});
    CHECK(other.verdict().contains("fist and flat were swapped"));
    CHECK(checked(model, exact_hands()).usable());
  }
  const Model model = cyberglove();
  CHECK(checked(model, exact_hands()).verdict().starts_with("good: "));
  for (const double share : {0.35, 0.5}) {
    Hands half = exact_hands();
    half[1] = part_of_fist(share);
    const auto check = checked(model, half);
    CHECK(check.failed() == std::vector{Pose::kFist});
    CHECK(check.verdict().contains("not closed"));
    Hands relaxed = exact_hands();
    relaxed[0] = part_of_fist(share);
    CHECK(checked(model, relaxed).verdict().contains("flat failed: the fingers were bent"));
  }
  Hands loose = exact_hands();
  loose[1] = loose[static_cast<std::size_t>(Pose::kTouchFist)] = part_of_fist(0.6);
  CHECK(
      checked(model, loose).verdict().starts_with("doubtful: the fist moved its sensors by 60 %"));
  Hands idle = exact_hands();
  for (double& angle : idle[2]) angle *= 0.3;
  CHECK(checked(model, idle).failed() == std::vector{Pose::kThumb});
}

TEST_CASE("honest people with unlike gloves pass") {
  const Model model = cyberglove();
  int doubtful = 0;
  for (unsigned seed = 1; seed <= 400; ++seed) {
    std::mt19937_64 random(seed);
    const auto normal = [&](double sd) {
      return std::normal_distribution<double>(0.0, sd)(random);
    };
    const bool wide = seed % 2 == 0;  // as two real calibrations
    std::vector<double> gain;
    const double common = normal(0.06);
    for (std::size_t i = 0; i < model.sensors.size(); ++i) {
      gain.push_back(std::exp(common + normal(wide ? 0.3 : 0.12)));
    }
    const Hands hands = inexact_hands(normal);
    const auto check = check_poses(model, sent(model, hands, gain)).value();
    INFO(seed << ": " << check.verdict());
    CHECK(check.usable());
    if (!wide && !check.doubts.empty()) ++doubtful;
  }
  CHECK(doubtful <= 4);
  // A glove that was built with other ranges, or counts the other way, is no pose shown wrongly.
  for (const std::string name : {"lucidgloves", "fivedt"}) {
    for (const double gain : {0.35, -0.8}) {
      const auto check = checked(model_of(name), exact_hands(), gain);
      INFO(name << ": " << check.verdict());
      CHECK(check.usable());
    }
  }
}

namespace {

// What a glove sends whose sensors measure shares of a range, `gain` times as far as the default's.
Recorded shares_sent(const Model& model, const Hands& hands, const std::vector<double>& gain) {
  const auto rows = parse_angle_map(model.map_toml, model.driver, model.sensors).value();
  Recorded recorded{};
  for (std::size_t p = 0; p < hands.size(); ++p) {
    for (const MapRow& row : rows) {
      Held& held = recorded[p][row.sensor];
      if (held.count > 0) continue;  // the joint that it bends first
      const Curve& curve = model.sensors[row.sensor].curve;
      const double share = hands[p][row.channel] / static_cast<double>(row.gain);
      const double whole = static_cast<double>(curve.raw[1] - curve.raw[0]) /
                           static_cast<double>(curve.value[1] - curve.value[0]);
      held.add(static_cast<float>(static_cast<double>(curve.raw[0]) +
                                  gain[row.sensor] * whole *
                                      (share - static_cast<double>(curve.value[0]))));
    }
  }
  return recorded;
}

}  // namespace

// Fingers that were never shown, on 20 simulated wearers whose fists are not exact. One sensor for
// a finger cannot tell a fist of 80, 100 and 60 degrees from a bend of 90, 100 and 70.
TEST_CASE("gloves that send shares of a range follow their wearer once calibrated") {
  for (const std::string name : {"lucidgloves", "fivedt"}) {
    const Model model = model_of(name);
    std::array<double, 2> off_deg{};  // rms, by default and calibrated
    for (unsigned seed = 1; seed <= 20; ++seed) {
      std::mt19937_64 random(seed);
      const auto normal = [&](double sd) {
        return std::normal_distribution<double>(0.0, sd)(random);
      };
      const auto share = [&] { return std::uniform_real_distribution<double>(0.0, 1.0)(random); };
      std::vector<double> gain;
      const double range = 0.5 + 0.5 * share();
      for (std::size_t i = 0; i < model.sensors.size(); ++i) {
        gain.push_back(range * std::exp(normal(0.12)));
      }
      CalibrationFile file{.driver = model.driver,
                           .glove = {},
                           .user = "ann",
                           .hand = Side::kRight,
                           .parameters = {},
                           .sensors = {}};
      const Recorded held = with_repeats(shares_sent(model, inexact_hands(normal), gain));
      file.sensors = fit_poses(model, held).value().sensors;
      Hands unseen{};
      for (HandAngles& hand : unseen) {
        for (std::size_t f = 1; f < kFingers; ++f) {
          const double bend = share();  // the 5DT has one sensor a finger
          hand[f * kFingerChannels] = 90.0 * bend * kDegree;
          hand[f * kFingerChannels + 3] = 100.0 * bend * kDegree;
          hand[f * kFingerChannels + 6] = 70.0 * bend * kDegree;
        }
      }
      const Recorded shown = shares_sent(model, unseen, gain);
      const auto off = [&](const Calibration& calibration) {
        double square = 0.0;
        for (std::size_t p = 0; p < unseen.size(); ++p) {
          const HandAngles made = angles_of(model, calibration, shown[p]);
          for (std::size_t f = 1; f < kFingers; ++f) {
            for (const std::size_t joint : {0, 3, 6}) {
              const std::size_t c = f * kFingerChannels + joint;
              square += std::pow((made[c] - unseen[p][c]) / kDegree, 2) / (12.0 * kPoses);
            }
          }
        }
        return square;
      };
      const std::array square{off(*default_calibration(model).value()),
                              off(*make_calibration(model, file, Side::kRight, "").value())};
      for (std::size_t i = 0; i < 2; ++i) off_deg[i] += square[i] / 20.0;
    }
    for (double& value : off_deg) value = std::sqrt(value);
    INFO(name << ": " << off_deg[0] << " by default, " << off_deg[1] << " calibrated");
    CHECK(off_deg[0] > 12.0);
    CHECK(off_deg[1] < 7.5);
  }
}

TEST_CASE("plugs of two fingers that were swapped are named, where fingers were touched alone") {
  const Model model = cyberglove();
  const auto at = [&](const char* name) {
    return static_cast<std::size_t>(std::ranges::find(model.sensors, name, &Sensor::name) -
                                    model.sensors.begin());
  };
  const auto swapped = [&](std::string_view joint) {
    Recorded recorded = sent(model, exact_hands(), std::vector(model.sensors.size(), 1.0));
    const std::string middle = "middle_" + std::string(joint), ring = "ring_" + std::string(joint);
    for (auto& pose : recorded) std::swap(pose[at(middle.c_str())], pose[at(ring.c_str())]);
    return recorded;
  };
  for (const char* const joint : {"mcp", "pip"}) {
    const auto check = check_poses(model, swapped(joint)).value();
    INFO(check.verdict());
    CHECK(check.usable());
    CHECK(check.verdict().starts_with("doubtful: middle_" + std::string(joint) + " and ring_" +
                                      joint + " bend as if swapped"));
  }
  Recorded brief = swapped("pip");
  std::fill(brief.begin() + kSensorPoses, brief.end(), std::array<Held, kMaxSensors>{});
  CHECK(check_poses(model, brief).value().verdict().contains("swapped plugs do not show"));
}

TEST_CASE("a pose held once more that is another hand fails") {
  const Model model = cyberglove();
  for (const auto& [pose, other] : {std::pair{Pose::kFlatAgain, part_of_fist(0.5)},
                                    {Pose::kTouchFist, part_of_fist(0.5)},
                                    {Pose::kSpreadAgain, hand_in(Pose::kFlat)}}) {
    Hands hands = exact_hands();
    hands[static_cast<std::size_t>(pose)] = other;
    const auto check = checked(model, hands);
    INFO(check.verdict());
    CHECK(check.failed() == std::vector{pose});
  }
}

TEST_CASE("a sensor that moved unlike its pose's others is named") {
  const Model model = cyberglove();
  std::vector<double> gain(model.sensors.size(), 0.85);
  const auto ring = std::ranges::find(model.sensors, "ring_pip", &Sensor::name);
  gain[static_cast<std::size_t>(ring - model.sensors.begin())] = 0.3;
  const auto check = check_poses(model, sent(model, exact_hands(), gain)).value();
  CHECK(check.usable());
  CHECK(check.verdict().starts_with("doubtful: ring_pip moved unlike the others"));
}

}  // namespace posed::drivers::glove
