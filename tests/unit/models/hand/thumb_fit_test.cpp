// The fit of a thumb to what it touches: on simulated hands, and on real signs left out of the fit.
#include "models/hand/thumb_fit.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>

#include "models/hand/constraint_solver.hpp"
#include "models/hand/geometry.hpp"
#include "tests/support/hand_signs.hpp"
#include "tests/support/shared.hpp"
#include "tests/unit/models/hand/hand_poses.hpp"

namespace posed::hand {
namespace {

using test::angle;

std::vector<ThumbPose> poses_of_sign(const std::filesystem::path& folder,
                                     const test::ThumbSign& sign) {
  std::vector<ThumbPose> poses;
  for (const HandAngles& angles : test::sign_poses(folder, sign.name)) {
    poses.push_back({.angles = angles,
                     .touched = sign.touched,
                     .beside = sign.name == "A",
                     .stretched = sign.name == "Y"});
  }
  return poses;
}

ThumbMap fit_without(const std::filesystem::path& folder, char twins) {
  std::vector<ThumbPose> poses;
  for (const test::ThumbSign& sign : test::kThumbSigns) {
    if (sign.twins != twins)
      std::ranges::copy(poses_of_sign(folder, sign), std::back_inserter(poses));
  }
  for (const std::string away : {"A", "Y"}) {
    std::ranges::copy(poses_of_sign(folder, {away, {}, ' '}), std::back_inserter(poses));
  }
  return fit_thumb(default_hand_shape(), poses);
}

}  // namespace

// Minutes: `unit_hand "[.judge]"`.
TEST_CASE("thumbs touch what they touch in real signs that the map was not fitted to", "[.judge]") {
  const auto folder = test::shared("data/gloves/libras_cyberglove");
  if (!folder) SKIP_WITHOUT_SHARED();
  const HandGeometry geometry = hand_geometry(default_hand_shape());
  HandAngles variance;
  variance.fill(1.0);
  std::ostringstream table;
  double sum_mm = 0.0, apart_sum_mm = 0.0, deepest_mm = 0.0;
  int contacts = 0;
  for (const test::ThumbSign& sign : test::kThumbSigns) {
    const ThumbMap map = fit_without(*folder, sign.twins);
    const auto poses = poses_of_sign(*folder, sign);
    for (int finger = 1; finger < kFingers; ++finger) {
      if (!sign.touched[static_cast<std::size_t>(finger)]) continue;
      const double share = 1e3 / static_cast<double>(poses.size());
      double gap_mm = 0.0, apart_mm = 0.0;
      for (ThumbPose pose : poses) {
        map.apply(pose.angles);
        gap_mm += share * thumb_gap_m(geometry, pose.angles, finger);
        ConstraintSolver().step(pose.angles, variance);
        apart_mm += share * thumb_gap_m(geometry, pose.angles, finger);
        deepest_mm = std::min(deepest_mm, 1e3 * min_gap_m(geometry, pose.angles));
      }
      table << sign.name << ' ' << kFingerNames[static_cast<std::size_t>(finger)] << ' ' << gap_mm
            << " -> " << apart_mm << " mm\n";
      sum_mm += std::abs(gap_mm);
      apart_sum_mm += apart_mm;
      ++contacts;
    }
  }
  WARN(table.str() << "mean " << sum_mm / contacts << ", kept apart " << apart_sum_mm / contacts
                   << ", deepest " << deepest_mm << " mm");
  CHECK(sum_mm / contacts < 8.0);
  CHECK(apart_sum_mm / contacts < 6.0);
  CHECK(deepest_mm >= 0.0);
}

TEST_CASE("a thumb's fit closes the gaps of a glove whose zeros and gains are off") {
  const HandGeometry geometry = hand_geometry(default_hand_shape());
  // From opposition with bent fingers to the index finger's side; what touches is measured.
  std::vector<ThumbPose> poses;
  const ThumbMap glove{.gain = {0.85, 1.2, 1.0, 1.0},
                       .offset_rad = {-20 * kDegree, 8 * kDegree, 4 * kDegree, 0.0}};
  for (int finger = 1; finger < kFingers; ++finger) {
    ThumbPose pose;
    for (int joint = 0; joint < kFingerJoints; ++joint) {
      pose.angles[angle(finger, joint, 0)] = 45 * kDegree;
    }
    pose.touched.set(static_cast<std::size_t>(finger));
    poses.push_back(pose);
  }
  poses.push_back({.beside = true});
  const ThumbMap true_map = fit_thumb(default_hand_shape(), poses);  // some thumb that does so
  std::vector<ThumbPose> measured = poses;
  for (ThumbPose& pose : measured) glove.apply(pose.angles);
  const auto worst_mm = [&](const ThumbMap& map, const std::vector<ThumbPose>& of) {
    double worst = 0.0;
    for (ThumbPose pose : of) {
      map.apply(pose.angles);
      for (int finger = 1; finger < kFingers; ++finger) {
        if (!pose.touched[static_cast<std::size_t>(finger)]) continue;
        worst = std::max(worst, std::abs(1e3 * thumb_gap_m(geometry, pose.angles, finger)));
      }
    }
    return worst;
  };
  CHECK(worst_mm(true_map, poses) < worst_mm({}, poses));
}

}  // namespace posed::hand
