#include "models/gesture/synthetic_signer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "models/random.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand.hpp"

namespace posed::gesture {
namespace {

using Hand = Eigen::RowVectorXd;  // 45 angles [deg]

enum class Stance : std::uint8_t { kClosed, kStraight, kSpread };

struct Gesture {
  std::string_view name;
  std::array<Stance, kFingers> stance;
};
constexpr Stance kC = Stance::kClosed, kS = Stance::kStraight, kW = Stance::kSpread;
constexpr std::array<Gesture, 6> kGestures{{{"g", {kC, kC, kC, kC, kC}},
                                            {"c", {kC, kS, kS, kC, kC}},
                                            {"p", {kW, kW, kW, kW, kW}},
                                            {"1", {kC, kW, kC, kC, kC}},
                                            {"3", {kC, kW, kW, kW, kC}},
                                            {"4", {kC, kW, kW, kW, kW}}}};

// A channel that a glove's sensor measures, with its angle in each stance [deg].
struct Sensor {
  int finger, joint, axis;
  std::array<double, 3> angle_deg;  // closed, straight, spread
};
constexpr std::array<Sensor, 19> kSensors{{
    {0, 0, 2, {38, 20, 5}}, {0, 1, 0, {45, 20, 6}}, {0, 2, 0, {50, 15, 4}}, {0, 0, 1, {8, 15, 35}},
    {1, 0, 0, {66, 12, 6}}, {1, 1, 0, {92, 14, 5}}, {1, 2, 0, {52, 8, 3}},  {1, 0, 1, {1, 12, 8}},
    {2, 0, 0, {72, 10, 5}}, {2, 1, 0, {95, 12, 4}}, {2, 2, 0, {56, 8, 3}},  {3, 0, 0, {74, 14, 7}},
    {3, 1, 0, {94, 18, 6}}, {3, 2, 0, {54, 10, 4}}, {3, 0, 1, {1, 4, 9}},   {4, 0, 0, {70, 18, 9}},
    {4, 1, 0, {88, 20, 8}}, {4, 2, 0, {50, 12, 5}}, {4, 0, 1, {3, 8, 18}},
}};

int channel_of(const Sensor& sensor) {
  return sensor.finger * kFingerChannels + 3 * sensor.joint + sensor.axis;
}

// What distinguishes this person.
struct Person {
  std::array<double, kSensors.size()> carriage_deg{}, range{};
  std::array<double, kFingers> late_s{};
  double pace = 1.0;

  explicit Person(PortableRandom& random) {
    for (double& value : carriage_deg) value = random.uniform(-3.0, 3.0);
    for (double& value : range) value = random.uniform(0.92, 1.08);
    for (double& value : late_s) value = random.uniform(-0.05, 0.05);
    pace = random.uniform(0.9, 1.1);
  }
};

double minimum_jerk(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
}

class SyntheticSigner {
 public:
  explicit SyntheticSigner(const SignerOptions& options)
      : options_(options), random_(options.person * 2654435761U + 29U), person_(random_) {}

  Performance perform(const std::vector<int>& script) {
    Hand hand = pose(script.front());
    for (const int gesture : script) {
      const std::size_t begin = rows_.size();
      hand = make(gesture, hand);
      labels_.push_back({time_s(begin), time_s(rows_.size()), std::string(kGestures[gesture].name),
                         static_cast<int>(labels_.size()) + 1});
    }
    return {measure(), std::move(labels_)};
  }

  std::vector<int> random_script() {
    std::vector<int> script{random_.below(3)};
    while (static_cast<int>(script.size()) < options_.gestures) {
      script.push_back((script.back() + 1 + random_.below(2)) % 3);
    }
    return script;
  }

 private:
  [[nodiscard]] double time_s(std::size_t frame) const {
    return static_cast<double>(frame) / options_.rate_hz;
  }

  // The pose of this repetition, with its random deviation.
  Hand pose(int gesture) {
    std::array<double, kFingers> vigour{};
    for (double& value : vigour) value = 1.0 + 0.04 * random_.normal();
    Hand hand = Hand::Zero(kHandChannels);
    for (std::size_t s = 0; s < kSensors.size(); ++s) {
      const Sensor& sensor = kSensors[s];
      const auto stance = static_cast<std::size_t>(kGestures[gesture].stance[sensor.finger]);
      hand[channel_of(sensor)] =
          person_.range[s] * vigour[sensor.finger] * sensor.angle_deg[stance] +
          person_.carriage_deg[s] + random_.normal();
    }
    return hand;
  }

  // Performs one gesture from `from` and returns the hand's pose at its end.
  Hand make(int gesture, const Hand& from) {
    const Hand target = pose(gesture);
    const double move_s = random_.uniform(0.4, 0.7) / person_.pace;
    const double hold_s = random_.uniform(1.1, 1.9) / person_.pace;
    const auto frames = static_cast<std::size_t>(std::lround((move_s + hold_s) * options_.rate_hz));
    Hand drift = Hand::Zero(kHandChannels);
    for (std::size_t t = 1; t <= frames; ++t) {
      Hand hand = Hand::Zero(kHandChannels);
      for (const Sensor& sensor : kSensors) {
        const int c = channel_of(sensor);
        const double since_s = time_s(t) - person_.late_s[sensor.finger] - 0.05;
        drift[c] = 0.97 * drift[c] + 0.12 * random_.normal();
        hand[c] = from[c] + (target[c] - from[c]) * minimum_jerk(since_s / move_s) + drift[c];
      }
      rows_.push_back(std::move(hand));
    }
    return rows_.back();
  }

  // The glove's measurement of the motion.
  clip::HandClip measure() {
    clip::HandClip clip;
    clip.path = "synthetic signer";
    clip.rate_hz = options_.rate_hz;
    clip.angles.resize(rows_.size());
    Hand shown = rows_.front();
    for (std::size_t t = 0; t < rows_.size(); ++t) {
      clip.time_s.push_back(time_s(t));
      for (const Sensor& sensor : kSensors) {
        const int c = channel_of(sensor);
        const double measured = rows_[t][c] + options_.noise_deg * random_.normal();
        if (std::abs(measured - shown[c]) > options_.dead_band_deg) shown[c] = measured;
        clip.angles[t][c] = kDegree * shown[c];
      }
    }
    return clip;
  }

  const SignerOptions& options_;
  PortableRandom random_;
  Person person_;
  std::vector<Hand> rows_;
  std::vector<clip::LabelSegment> labels_;
};

}  // namespace

Result<Performance> make_performance(const SignerOptions& options) {
  SyntheticSigner signer(options);
  if (options.script.empty()) return signer.perform(signer.random_script());
  std::vector<int> script;
  for (const std::string& label : options.script) {
    const auto found = std::ranges::find(kGestures, label, &Gesture::name);
    if (found == kGestures.end()) return fail("no synthetic signer knows '" + label + "'");
    script.push_back(static_cast<int>(found - kGestures.begin()));
  }
  return signer.perform(script);
}

}  // namespace posed::gesture
