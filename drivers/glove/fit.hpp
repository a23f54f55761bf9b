// Computes a user's calibration from a few poses of the hand, held still. Cold.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// The first four fit the sensors. Contacts, of which not the angles are known but what the thumb
// touches, fit the thumb. Poses held once more say how exactly the user holds them; the fist with
// the thumb across is both.
enum class Pose : std::uint8_t {
  kFlat,
  kFist,
  kThumb,
  kSpread,
  kTouchIndex,
  kTouchMiddle,
  kTouchRing,
  kTouchLittle,
  kTouchFist,
  kFlatAgain,
  kSpreadAgain
};
inline constexpr std::size_t kPoses = 11;
inline constexpr std::size_t kSensorPoses = 4;
inline constexpr std::array<std::string_view, kPoses> kPoseNames{
    "flat",       "fist",         "thumb",      "spread",     "touch-index", "touch-middle",
    "touch-ring", "touch-little", "touch-fist", "flat-again", "spread-again"};
// The finger that the thumb touches, 1 the index; 0: not a contact.
[[nodiscard]] constexpr int touched_finger(Pose pose) noexcept {
  if (pose == Pose::kTouchFist) return 2;
  const auto index = static_cast<std::size_t>(pose);
  const bool contact = index >= kSensorPoses && pose < Pose::kTouchFist;
  return contact ? static_cast<int>(index - kSensorPoses) + 1 : 0;
}
// Contacts and repeats: without them the sensors are fitted, but the fit is not confirmed.
[[nodiscard]] constexpr bool may_be_skipped(Pose pose) noexcept {
  return static_cast<std::size_t>(pose) >= kSensorPoses;
}
// The pose that this one shows once more (a fist with the thumb across: of the fingers); else
// itself.
[[nodiscard]] constexpr Pose first_of(Pose pose) noexcept {
  if (pose == Pose::kTouchFist) return Pose::kFist;
  if (pose == Pose::kFlatAgain) return Pose::kFlat;
  return pose == Pose::kSpreadAgain ? Pose::kSpread : pose;
}
// Instructions to the user.
inline constexpr std::array<std::string_view, kPoses> kPoseHints{
    "lay the hand flat on the table, fingers together and straight, thumb beside the index",
    "make a fist, tight, with the thumb outside",
    "fingers straight, the thumb bent across the palm to the root of the little finger",
    "spread all fingers as far as they go, hand flat",
    "touch the tip of the index finger with the tip of the thumb, the other fingers stretched",
    "touch the tip of the middle finger with the tip of the thumb, the other fingers stretched",
    "touch the tip of the ring finger with the tip of the thumb, the other fingers stretched",
    "touch the tip of the little finger with the tip of the thumb, the other fingers stretched",
    "make a fist, tight, with the thumb across it, its tip on the middle finger",
    "lay the hand flat on the table once more, as the first time",
    "spread all fingers once more, as far as they go, hand flat"};

// Joint angles of a hand in a pose [rad]: an average over people, so the fitted angles are only as
// accurate as the user's poses. Contacts are of posed's own hand, and fit no sensor.
[[nodiscard]] HandAngles hand_in(Pose pose);

// The raw values of one sensor while a pose was held.
struct Held {
  double sum = 0.0;
  std::size_t count = 0;
  double squares = 0.0;
  void add(float raw) {
    sum += static_cast<double>(raw);
    squares += static_cast<double>(raw) * static_cast<double>(raw);
    ++count;
  }
  [[nodiscard]] double mean() const { return sum / static_cast<double>(count); }
  // Standard deviation: a measure of how still the sensor was.
  [[nodiscard]] double deviation() const;
};
using Recorded = std::array<std::array<Held, kMaxSensors>, kPoses>;  // [pose][sensor]

// The poses as they were held, but for those that were held once more: each sensor has the mean.
[[nodiscard]] Recorded with_repeats(Recorded recorded);

// Whether a pose with these sensors was recorded.
[[nodiscard]] bool was_held(std::span<const Held> pose);

// The two poses that define a sensor's calibration: the flat hand and the pose that moves it most.
struct SensorPoses {
  std::size_t sensor = 0;
  Pose pose = Pose::kFist;
  double flat_raw = 0.0, pose_raw = 0.0;
  double flat_value = 0.0, pose_value = 0.0;  // calibrated values at these poses

  // The movement by the driver's default curve, as a share of the pose's: 1 when the sensor has the
  // default's gain and the pose is exact, negative when it moved the other way.
  double by_default = 1.0;

  [[nodiscard]] double span() const;  // difference of the raw values
};

// Whether the default curve of the sensor has the gain of a real glove, in radians. Shares of a
// finger's range depend on how the glove was built.
[[nodiscard]] inline bool gain_is_known(const Sensor& sensor) { return sensor.unit == "rad"; }

// For each sensor that was measured with the flat hand and that a recorded pose moves.
Result<std::vector<SensorPoses>> poses_of_sensors(const Model& model, const Recorded& recorded);

struct Fitted {
  std::map<std::string, std::vector<std::array<double, 2>>> sensors;  // for CalibrationFile
  // About sensors that keep their default although a pose should move them.
  std::vector<std::string> warnings;
};

// Takes two points per sensor: the flat hand and the pose that moves it most. People do not hold a
// pose exactly, so a known default gain counts, too: for a fist hardly, for a spread hand, whose
// angles are small, about as much as the pose. A sensor that no pose moves keeps its default; so
// does one that moved less than 10 counts, with a warning. Fails when no flat hand was recorded, or
// no sensor moved at all.
Result<Fitted> fit_poses(const Model& model, const Recorded& recorded);

// The calibrated values [sensor] of a hand in this pose, before the device's own formula; not
// finite for a sensor that the map does not name.
Result<std::vector<double>> values_of(const Model& model, const HandAngles& hand);

// The raw value at which the curve has this value, by its piece there; not finite where it is flat.
[[nodiscard]] double raw_at(const Curve& curve, double value);

// Fills in the poses that fit sensors as this calibration has them, for the sensors of which
// `recorded` has a contact: contacts alone then fit a thumb that was calibrated before.
Result<> add_known_poses(const Model& model, const Calibration& calibration, Recorded& recorded);

// The angles of a hand whose sensors have the means of `held`, as a decoder with this calibration
// of the model gives them; not finite for a channel without a measured sensor.
[[nodiscard]] HandAngles angles_of(const Model& model, const Calibration& calibration,
                                   std::span<const Held> held);

// The smallest movement of a sensor that is accepted for a calibration [counts].
[[nodiscard]] double least_span(const Sensor& sensor);

}  // namespace posed::drivers::glove
