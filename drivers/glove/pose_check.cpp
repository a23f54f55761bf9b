#include "drivers/glove/pose_check.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>

#include "drivers/glove/angle_map.hpp"
#include "proto/frame/median.hpp"
#include "proto/text/list.hpp"

namespace posed::drivers::glove {
namespace {

// Measured on three real CyberGlove recordings of grasps (GraspDB14) in windows of 2 s. While a
// hand holds still, no sensor moves by more than 0.10 of its span (standard deviation; median
// 0.02), except in one window with 0.12. While it grasps, between 38 % and all of the sensors move
// by more (median 0.2 to 0.4).
constexpr double kMovedShare = 0.1;
// A sensor with a span below this share of its range is measured relative to the range: noise.
constexpr double kMinTravel = 0.04;
// Share of the span between two poses that the driver's default predicts.
constexpr double kStuckShare = 0.1;
constexpr double kFailedShare = 0.25;  // share of a pose's sensors

// In one still hand sensors tremble alike; one that does this much more has moved.
constexpr double kDriftShare = 0.05, kDriftRatio = 5.0;

// The median movement of a pose's sensors, as a share of the driver's default gains. In simulation
// (gains off by 12 % each and 6 % together, poses by 5 degrees) a fist stays within 0.8 and 1.3,
// and two real calibrations have 0.7: both are sure. Thumbs and spread hands differ more from
// person to person.
struct Range {
  double least, most;
  [[nodiscard]] bool has(double value) const { return value >= least && value <= most; }
};
constexpr Range kFistGain{0.55, 1.7}, kSureFistGain{0.65, 1.4}, kOtherGain{0.35, 4.0};
constexpr Range kOddShare{0.4, 2.5};  // of one sensor, of its pose's median
// Straight fingers in another pose than the flat hand, as a share of the way to the fist.
constexpr Range kStraight{-0.25, 0.7}, kSureStraight{-0.12, 0.12};
// A pose held once more, as a share of the movement. A spread hand's is small: 5 degrees of 15.
constexpr double kUnlike = 0.25;
constexpr Range kSpreadAgain{1.0 / 3.0, 3.0};
// By how much, of its way to the fist, a finger bends more where it is touched than another does,
// at least. In LIBRAS' signs F and D (index, middle) and V and W (ring, little), whose other
// fingers are not stretched: 0.46 to 1.1.
constexpr double kToldApart = 0.1;

constexpr std::size_t kNamed = 3;  // sensors named in a sentence

double range_of(const Sensor& sensor) { return sensor.raw_max - sensor.raw_min; }

// By how much the raw value changes, by default, while the calibrated one goes from `from` to `to`.
double default_span(const Sensor& sensor, double from, double to) {
  const auto at = [&](double raw) {
    return static_cast<double>(sensor.curve.value_at(static_cast<float>(raw)));
  };
  const double whole = std::abs(at(sensor.raw_max) - at(sensor.raw_min));
  return whole > 0.0 ? range_of(sensor) * std::abs(to - from) / whole : 0.0;
}

bool is_stuck(const Sensor& sensor, const SensorPoses& at) {
  const double expected = default_span(sensor, at.flat_value, at.pose_value);
  return at.span() < std::max(least_span(sensor), kStuckShare * expected);
}

std::string named(const std::vector<std::string>& sensors) {
  const std::string text = joined(std::span(sensors).first(std::min(sensors.size(), kNamed)));
  return sensors.size() > kNamed ? text + ", ..." : text;
}

bool too_many(std::size_t bad, int all) {
  if (bad == 0) return false;
  return static_cast<double>(bad) > kFailedShare * all && (bad > 1 || all <= static_cast<int>(bad));
}

PoseFinding find(const Model& model, const Recorded& recorded, Pose pose,
                 const std::vector<SensorPoses>& sensors) {
  PoseFinding finding{.pose = pose, .moved = {}, .stuck = {}};
  std::vector<double> unrest;
  std::vector<std::string> names;
  for (const SensorPoses& at : sensors) {
    const bool all = first_of(pose) == Pose::kFlat || touched_finger(pose) != 0;
    if (!all && at.pose != first_of(pose)) continue;
    const Sensor& sensor = model.sensors[at.sensor];
    ++finding.sensors;
    const double way = std::max(at.span(), kMinTravel * range_of(sensor));
    names.push_back(sensor.name);
    unrest.push_back(recorded[static_cast<std::size_t>(pose)][at.sensor].deviation() / way);
    if (unrest.back() > kMovedShare) {
      finding.moved.push_back(sensor.name);
    } else if (at.pose == pose && is_stuck(sensor, at)) {
      finding.stuck.push_back(sensor.name);
    }
  }
  if (unrest.empty()) return finding;
  finding.unrest = median(std::vector(unrest));
  const double limit = std::clamp(kDriftRatio * finding.unrest, kDriftShare, kMovedShare);
  for (std::size_t i = 0; i < unrest.size(); ++i) {
    if (unrest[i] > limit) finding.restless.push_back(names[i]);
  }
  return finding;
}

std::string percent(double share) { return std::to_string(std::lround(100.0 * share)) + " %"; }

// Compares poses with each other and with the driver's default gains.
class Comparison {
 public:
  Comparison(const Model& model, const Recorded& recorded, const std::vector<SensorPoses>& sensors,
             PoseCheck& check)
      : model_(model), recorded_(recorded), sensors_(sensors), check_(check) {}

  void run() {
    for (const Pose pose : {Pose::kThumb, Pose::kSpread, Pose::kFlatAgain, Pose::kSpreadAgain}) {
      const auto share = way_to_fist(pose);
      if (share) straight_.push_back(*share);
      if (first_of(pose) == pose) judge_gain(pose, kOtherGain, "the hand did not take the pose");
    }
    judge_fist();
    judge_repeats();
    name_odd();
    tell_fingers_apart();
  }

 private:
  void fail(Pose pose, const std::string& why) {
    for (PoseFinding& finding : check_.poses) {
      if (finding.pose == pose && finding.wrong.empty()) finding.wrong = why;
    }
  }

  // The median movement of the pose's sensors, as a share of the default's; none where the gains
  // are not known, or nothing moved.
  [[nodiscard]] std::optional<double> gain(Pose pose) const {
    std::vector<double> gains;
    for (const SensorPoses& at : sensors_) {
      const Sensor& sensor = model_.sensors[at.sensor];
      if (at.pose == pose && gain_is_known(sensor) && !is_stuck(sensor, at)) {
        gains.push_back(at.by_default);
      }
    }
    return gains.empty() ? std::nullopt : std::optional(median(gains));
  }

  // Where a sensor is in a pose: 0 as in the flat hand, 1 as in the pose that moves it most.
  [[nodiscard]] std::optional<double> way(const SensorPoses& at, Pose pose) const {
    const Held& held = recorded_[static_cast<std::size_t>(pose)][at.sensor];
    if (held.count == 0 || is_stuck(model_.sensors[at.sensor], at)) return std::nullopt;
    return (held.mean() - at.flat_raw) / (at.pose_raw - at.flat_raw);
  }

  // Where the fingers are in a pose: 0 as in the flat hand, 1 as in the fist (or in `other`).
  [[nodiscard]] std::optional<double> way_to_fist(Pose pose, Pose other = Pose::kFist) const {
    std::vector<double> shares;
    for (const SensorPoses& at : sensors_) {
      const auto share = at.pose == other ? way(at, pose) : std::nullopt;
      if (share) shares.push_back(*share);
    }
    return shares.empty() ? std::nullopt : std::optional(median(shares));
  }

  void judge_gain(Pose pose, const Range& range, const std::string& why) {
    const auto share = gain(pose);
    if (share && !range.has(std::abs(*share))) fail(pose, moved_by(*share) + ": " + why);
  }

  static std::string moved_by(double share) {
    return share < 0.0
               ? "its sensors moved the other way than this type of glove's do"
               : "its sensors moved by " + percent(share) + " of what this type of glove's do";
  }

  void judge_fist() {
    const auto share = gain(Pose::kFist);
    if (straight_.empty() && !share) return;
    const bool repeated = !straight_.empty();
    // Of straight fingers in other poses, the most and the least bent. They know the flat hand,
    // whichever way the glove counts.
    const double least = repeated ? std::ranges::min(straight_) : 0.0;
    const double most = repeated ? std::ranges::max(straight_) : 0.0;
    const bool backwards = !share || *share < 0.0;
    if (repeated ? backwards && least > kStraight.most : backwards) {
      for (const Pose pose : {Pose::kFlat, Pose::kFist}) fail(pose, "fist and flat were swapped");
      return;
    }
    if (most < kStraight.least) {
      fail(Pose::kFlat, "the fingers were bent; in other poses they are straighter, by " +
                            percent(-most) + " of the way to the fist");
      return;
    }
    const double across = way_to_fist(Pose::kTouchFist).value_or(1.0);
    if (across > 1.0 + kUnlike) {
      fail(Pose::kFist, "it was not closed; with the thumb across it closed to " + percent(across));
    } else if (share && !kFistGain.has(std::abs(*share))) {
      const std::string why =
          moved_by(std::abs(*share)) + ": the fist was not closed, or the flat hand was not flat";
      fail(Pose::kFist, why);
      if (!repeated) fail(Pose::kFlat, why);
    } else if (share && !kSureFistGain.has(std::abs(*share))) {
      check_.doubts.push_back("the fist moved its sensors by " + percent(std::abs(*share)) +
                              " of what this type of glove's do: was it tight, and the flat hand "
                              "flat?");
    }
    if (least > kSureStraight.most || most < kSureStraight.least) {
      check_.doubts.push_back("straight fingers differ from pose to pose by " +
                              percent(std::min(std::abs(least), std::abs(most))) +
                              " of the way to the fist");
    }
  }

  // Poses held once more that were another hand.
  void judge_repeats() {
    const auto first_failed = [](const PoseFinding& finding) {
      return (finding.pose == Pose::kFlat || finding.pose == Pose::kFist) && finding.failed();
    };
    if (std::ranges::any_of(check_.poses, first_failed)) return;
    const double closed = way_to_fist(Pose::kTouchFist).value_or(1.0);
    if (closed < 1.0 - kUnlike) {
      fail(Pose::kTouchFist,
           "the fingers were closed to " + percent(closed) + " of the fist without the thumb");
    }
    const double bent = way_to_fist(Pose::kFlatAgain).value_or(0.0);
    if (std::abs(bent) > kUnlike) {
      fail(Pose::kFlatAgain, "the fingers differ from the first flat hand's by " +
                                 percent(std::abs(bent)) + " of the way to the fist");
    }
    const double spread = way_to_fist(Pose::kSpreadAgain, Pose::kSpread).value_or(1.0);
    if (!kSpreadAgain.has(spread)) {
      fail(Pose::kSpreadAgain, "the hand was spread to " + percent(spread) + " of the first time");
    }
  }

  // Of finger `f`, the sensor that bends this joint first.
  [[nodiscard]] const SensorPoses* bend_of(std::span<const MapRow> rows, std::size_t f,
                                           std::size_t joint) const {
    for (const SensorPoses& at : sensors_) {
      const auto row = std::ranges::find(rows, at.sensor, &MapRow::sensor);
      if (at.pose == Pose::kFist && row != rows.end() &&
          row->channel == f * kFingerChannels + 3 * joint) {
        return &at;
      }
    }
    return nullptr;
  }

  // A finger bends where the thumb touches it, and others less: sensors that show it the other way
  // round are plugged in for each other. The last joint says nothing: it may bend backwards.
  void tell_fingers_apart() {
    const auto rows = parse_angle_map(model_.map_toml, model_.driver, model_.sensors);
    if (!rows) return;
    const auto touch = [](std::size_t finger) {
      return static_cast<Pose>(kSensorPoses + finger - 1);
    };
    std::vector<std::string> unlike;
    std::size_t told = 0;
    for (std::size_t joint = 0; joint < 2; ++joint) {
      for (std::size_t a = 1; a < kFingers; ++a) {
        for (std::size_t b = a + 1; b < kFingers; ++b) {
          const SensorPoses* const of_a = bend_of(*rows, a, joint);
          const SensorPoses* const of_b = bend_of(*rows, b, joint);
          if (of_a == nullptr || of_b == nullptr) continue;
          const auto aa = way(*of_a, touch(a)), ab = way(*of_a, touch(b));
          const auto ba = way(*of_b, touch(a)), bb = way(*of_b, touch(b));
          if (!aa || !ab || !ba || !bb) continue;
          ++told;
          if (*aa + *bb - *ab - *ba > kToldApart) continue;
          unlike.push_back(model_.sensors[of_a->sensor].name + " and " +
                           model_.sensors[of_b->sensor].name);
        }
      }
    }
    if (told == 0) {
      check_.doubts.emplace_back("no finger was touched alone, so swapped plugs do not show");
    } else if (!unlike.empty()) {
      check_.doubts.push_back(named(unlike) +
                              " bend as if swapped, or no finger was touched alone: are they in "
                              "each other's plug?");
    }
  }

  // Sensors that moved unlike the others in the fist.
  void name_odd() {
    std::vector<std::string> odd;
    const double typical = gain(Pose::kFist).value_or(0.0);
    for (const SensorPoses& at : sensors_) {
      const Sensor& sensor = model_.sensors[at.sensor];
      const bool stuck = is_stuck(sensor, at);
      const bool unlike = at.pose == Pose::kFist && gain_is_known(sensor) && typical != 0.0 &&
                          !kOddShare.has(at.by_default / typical);
      if (stuck || unlike) odd.push_back(sensor.name);
    }
    if (odd.empty()) return;
    check_.doubts.push_back(named(odd) +
                            " moved unlike the others: a loose sensor, or swapped "
                            "plugs?");
  }

  const Model& model_;
  const Recorded& recorded_;
  const std::vector<SensorPoses>& sensors_;
  PoseCheck& check_;
  std::vector<double> straight_;
};

}  // namespace

bool PoseFinding::failed() const {
  return !wrong.empty() || too_many(moved.size() + stuck.size(), sensors);
}

std::string PoseFinding::sentence() const {
  const std::string of_all = " of " + std::to_string(sensors) + " sensors ";
  std::string why = wrong;
  if (!moved.empty()) {
    add_word(why, std::to_string(moved.size()) + of_all + "moved while it was held (" +
                      named(moved) + ")");
  }
  if (!stuck.empty()) {
    add_word(why, std::to_string(stuck.size()) + of_all + "hardly moved from the flat hand (" +
                      named(stuck) + ")");
  }
  return std::string(kPoseNames[static_cast<std::size_t>(pose)]) + " failed: " + why +
         ": hold it again";
}

std::vector<Pose> PoseCheck::failed() const {
  std::vector<Pose> failed;
  for (const PoseFinding& finding : poses) {
    if (finding.failed()) failed.push_back(finding.pose);
  }
  return failed;
}

std::string PoseCheck::verdict() const {
  std::string text;
  std::vector<std::string> restless;
  double unrest = 0.0;
  for (const PoseFinding& finding : poses) {
    unrest = std::max(unrest, finding.unrest);
    std::ranges::copy(finding.restless, std::back_inserter(restless));
    if (finding.failed()) add_word(text, finding.sentence(), "; ");
  }
  if (!text.empty()) return text;
  return (doubts.empty() ? "good: " : "doubtful: " + joined(doubts, "; ") + "; ") +
         "the hand was still in every pose (sensors trembled by " +
         std::to_string(std::lround(100.0 * unrest)) + " % of their movement), " +
         std::to_string(sensors) + " sensors moved between them" +
         (restless.empty() ? "" : "; less still: " + named(restless));
}

Result<PoseCheck> check_poses(const Model& model, const Recorded& recorded) {
  const auto sensors = TRY(poses_of_sensors(model, recorded));
  PoseCheck check;
  check.sensors = static_cast<int>(sensors.size());
  for (std::size_t p = 0; p < kPoses; ++p) {
    if (was_held(recorded[p]))
      check.poses.push_back(find(model, recorded, static_cast<Pose>(p), sensors));
  }
  Comparison(model, recorded, sensors, check).run();
  return check;
}

}  // namespace posed::drivers::glove
