#include "daemon/devices/pose_calibration.hpp"

#include <algorithm>
#include <bitset>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "drivers/glove/crosstalk.hpp"
#include "drivers/glove/possible_angles.hpp"
#include "models/hand/geometry.hpp"
#include "models/hand/thumb_fit.hpp"
#include "proto/frame/degree.hpp"

namespace posed::devices {
namespace {

using drivers::glove::CalibrationFile;
using drivers::glove::Model;
using drivers::glove::Pose;
using drivers::glove::Recorded;
using drivers::glove::touched_finger;

// The poses of which it is known where the thumb is: what it touches, beside the index finger in
// the flat hand, away from the hand where all is spread.
std::vector<hand::ThumbPose> contacts_of(const Model& model,
                                         const drivers::glove::Calibration& calibration,
                                         const Recorded& recorded) {
  std::vector<hand::ThumbPose> poses;
  for (std::size_t p = 0; p < drivers::glove::kPoses; ++p) {
    const auto pose = static_cast<Pose>(p);
    const int touched = touched_finger(pose);
    const bool known = touched != 0 || pose == Pose::kFlat || pose == Pose::kSpread;
    if (!known || !drivers::glove::was_held(recorded[p])) continue;
    hand::ThumbPose contact{.angles = drivers::glove::angles_of(model, calibration, recorded[p]),
                            .touched = {},
                            .beside = pose == Pose::kFlat,
                            .stretched = pose == Pose::kSpread};
    // A joint that no sensor measures is straight.
    for (double& angle_rad : contact.angles) {
      if (!std::isfinite(angle_rad)) angle_rad = 0.0;
    }
    if (touched != 0) contact.touched.set(static_cast<std::size_t>(touched));
    poses.push_back(contact);
  }
  return poses;
}

// The row of the map that alone gives this angle, from a sensor that gives nothing else.
std::optional<drivers::glove::MapRow> only_row(std::span<const drivers::glove::MapRow> rows,
                                               std::size_t angle) {
  const auto of_angle = [&](const auto& row) { return row.channel == angle; };
  const auto row = std::ranges::find_if(rows, of_angle);
  if (row == rows.end() || std::ranges::count_if(rows, of_angle) != 1) return std::nullopt;
  const auto shares = std::ranges::count(rows, row->sensor, &drivers::glove::MapRow::sensor);
  return shares == 1 ? std::optional(*row) : std::nullopt;
}

// With angle = k value + b, the angle's gain g and offset o are gain g and this offset of the
// value.
void change_sensor(const drivers::glove::MapRow& row, const drivers::glove::Sensor& sensor,
                   double g, double o, CalibrationFile& file) {
  const auto points = file.sensors.find(sensor.name);
  const double k = static_cast<double>(row.gain) * sensor.map_sign;
  if (points == file.sensors.end() || k == 0.0) return;
  const auto b = static_cast<double>(row.offset_rad);
  for (auto& point : points->second) point[1] = g * point[1] + (g * b + o - b) / k;
}

double gap_mm(const hand::HandGeometry& geometry, const hand::ThumbPose& pose, int finger) {
  return 1e3 * hand::thumb_gap_m(geometry, pose.angles, finger);
}

bool measures_opposition(const drivers::glove::Calibration& calibration) {
  return only_row(std::span(calibration.map).first(calibration.map_rows), hand::kThumbAngles[0])
      .has_value();
}

// Contacts that the fitted thumb misses.
void check_contacts(const Model& model, const Recorded& recorded, PoseCalibration& made) {
  constexpr double kMissed_mm = 15.0, kDeep_mm = -8.0;
  if (!measures_opposition(*made.calibration)) return;
  const hand::HandGeometry geometry = hand::hand_geometry(default_hand_shape());
  for (const hand::ThumbPose& pose : contacts_of(model, *made.calibration, recorded)) {
    for (int finger = 1; finger < kFingers; ++finger) {
      if (!pose.touched[static_cast<std::size_t>(finger)]) continue;
      const double gap = gap_mm(geometry, pose, finger);
      if (gap < kMissed_mm && gap > kDeep_mm) continue;
      made.doubts.push_back(fmt::format("the thumb that touched the {} finger is {:.0f} mm {} it",
                                        kFingerNames[static_cast<std::size_t>(finger)],
                                        std::abs(gap), gap > 0.0 ? "from" : "inside"));
    }
  }
}

// How far the same pose, held twice, differs: that is how exactly the user holds it, and the mean
// of both is off by half as much.
void compare_repeats(const Model& model, const Recorded& recorded, PoseCalibration& made) {
  constexpr double kFar_deg = 8.0;  // people who take care: 3 to 6
  constexpr double kWorst_deg = 25.0;
  const auto& calibration = *made.calibration;
  std::bitset<kHandChannels> mapped;
  for (const auto& row : std::span(calibration.map).first(calibration.map_rows)) {
    mapped.set(row.channel);
  }
  std::pair<double, std::size_t> worst;  // [deg], channel
  double squares = 0.0;
  std::size_t count = 0;
  for (std::size_t p = 0; p < recorded.size(); ++p) {
    const Pose first = drivers::glove::first_of(static_cast<Pose>(p));
    const auto& before = recorded[static_cast<std::size_t>(first)];
    if (&before == &recorded[p] || !drivers::glove::was_held(recorded[p]) ||
        !drivers::glove::was_held(before)) {
      continue;
    }
    const HandAngles a = drivers::glove::angles_of(model, calibration, before);
    const HandAngles b = drivers::glove::angles_of(model, calibration, recorded[p]);
    const std::size_t from = first == Pose::kFist ? kFingerChannels : 0;  // the thumb moved
    for (std::size_t c = from; c < a.size(); ++c) {
      const double apart_deg = std::abs(a[c] - b[c]) / kDegree;
      if (!mapped[c] || !std::isfinite(apart_deg)) continue;
      squares += apart_deg * apart_deg;
      ++count;
      worst = std::max(worst, std::pair(apart_deg, c));
    }
  }
  if (count == 0) {
    made.doubts.emplace_back("no pose was held twice, so how exactly they were held is not known");
    return;
  }
  const double apart_deg = std::sqrt(squares / static_cast<double>(count));
  auto sentence =
      fmt::format("poses held twice differed by {:.1f} degrees (rms), most {} by {:.0f}", apart_deg,
                  drivers::glove::joint_words(worst.second), worst.first);
  auto& list = apart_deg > kFar_deg || worst.first > kWorst_deg ? made.doubts : made.said;
  list.push_back(std::move(sentence));
}

}  // namespace

drivers::glove::CalibrationFile blank_calibration(const drivers::glove::Model& model,
                                                  const std::string& identity, Side hand,
                                                  std::string user) {
  return {.driver = model.driver,
          .glove = identity.starts_with('/') ? std::string() : identity,
          .user = std::move(user),
          .hand = hand,
          .parameters = {},
          .sensors = {}};
}

std::string PoseCalibration::refusal() const {
  constexpr std::size_t kMaxImpossible = 5;  // a sensor or a finger may be faulty
  if (impossible <= kMaxImpossible) return {};
  return fmt::format("{} joints would be bent as no hand's are: show the poses again", impossible);
}

Result<PoseCalibration> calibrate_by_poses(const drivers::glove::Model& model,
                                           const drivers::glove::Recorded& recorded,
                                           drivers::glove::CalibrationFile blank) {
  const Recorded held = drivers::glove::with_repeats(recorded);
  auto fitted = TRY(drivers::glove::fit_poses(model, held));
  blank.sensors = std::move(fitted.sensors);
  const auto said = TRY(drivers::glove::fit_fist(model, held, blank.hand, blank));
  auto made = TRY(calibrate_by_contacts(model, held, std::move(blank)));
  compare_repeats(model, recorded, made);
  made.said.insert(made.said.begin(), said.begin(), said.end());
  made.warnings.insert(made.warnings.begin(), fitted.warnings.begin(), fitted.warnings.end());
  return made;
}

Result<PoseCalibration> calibrate_by_contacts(const drivers::glove::Model& model,
                                              const drivers::glove::Recorded& recorded,
                                              drivers::glove::CalibrationFile file) {
  PoseCalibration made{
      .file = std::move(file), .calibration = {}, .said = {}, .warnings = {}, .doubts = {}};
  const Side hand = made.file.hand;
  made.said = TRY(fit_contacts(model, recorded, hand, made.file));
  auto odd = TRY(drivers::glove::keep_possible(model, recorded, hand, made.file));
  made.impossible = odd.size();
  if (made.impossible > 0) {
    made.doubts.push_back(fmt::format("{} would be bent as no hand's is",
                                      made.impossible > 1 ? "joints" : "a joint"));
  }
  std::ranges::move(odd, std::back_inserter(made.warnings));
  made.calibration = TRY(drivers::glove::make_calibration(model, made.file, hand, /*identity=*/""));
  check_contacts(model, recorded, made);
  return made;
}

Result<std::vector<std::string>> fit_contacts(const Model& model, const Recorded& recorded,
                                              Side hand, CalibrationFile& file) {
  const auto calibration =
      TRY(drivers::glove::make_calibration(model, file, hand, /*identity=*/""));
  const auto poses = contacts_of(model, *calibration, recorded);
  const bool touches =
      std::ranges::any_of(poses, [](const auto& pose) { return pose.touched.any(); });
  std::vector<std::string> sentences;
  if (!touches) return sentences;
  if (!measures_opposition(*calibration)) {
    sentences.emplace_back(
        "this glove does not measure how far the thumb opposes: contacts change "
        "nothing");
    return sentences;
  }
  const std::span rows(calibration->map.data(), calibration->map_rows);
  const HandShape& shape = default_hand_shape();
  const hand::HandGeometry geometry = hand::hand_geometry(shape);
  const hand::ThumbMap fit = hand::fit_thumb(shape, poses);
  for (std::size_t i = 0; i < hand::kThumbAngles.size(); ++i) {
    const auto row = only_row(rows, hand::kThumbAngles[i]);
    if (!row) continue;
    change_sensor(*row, model.sensors[row->sensor], fit.gain[i], fit.offset_rad[i], file);
  }
  const auto fitted = TRY(drivers::glove::make_calibration(model, file, hand, /*identity=*/""));
  const auto after = contacts_of(model, *fitted, recorded);
  for (std::size_t p = 0; p < poses.size(); ++p) {
    for (int finger = 1; finger < kFingers; ++finger) {
      if (!poses[p].touched[static_cast<std::size_t>(finger)]) continue;
      sentences.push_back(fmt::format("thumb to {} {:.0f} mm, without contacts {:.0f} mm",
                                      kFingerNames[static_cast<std::size_t>(finger)],
                                      gap_mm(geometry, after[p], finger),
                                      gap_mm(geometry, poses[p], finger)));
    }
  }
  return sentences;
}

}  // namespace posed::devices
