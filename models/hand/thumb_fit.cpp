#include "models/hand/thumb_fit.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include "models/hand/geometry.hpp"
#include "models/hand/segments.hpp"
#include "models/random.hpp"
#include "proto/frame/degree.hpp"

namespace posed::hand {
namespace {

constexpr int kParameters = 8;  // gain and offset of each angle
constexpr int kIndex = 1;

// Prior standard deviations. The abduction's sensor is the least linear one; the joints beyond it
// bend as they say.
constexpr std::array<double, kThumbAngles.size()> kGainSigma{0.2, 0.4, 0.15, 0.15};
constexpr std::array<double, kThumbAngles.size()> kOffsetSigma_deg{40.0, 20.0, 12.0, 12.0};
constexpr double kPriorWeight = 1.0;

// What a thumb's joints can do, in the order of kThumbAngles; a pose beyond it is not believed.
constexpr std::array<AngleRange, kThumbAngles.size()> kPossible{{{-90 * kDegree, 150 * kDegree},
                                                                 {-40 * kDegree, 60 * kDegree},
                                                                 {-10 * kDegree, 65 * kDegree},
                                                                 {-15 * kDegree, 90 * kDegree}}};
constexpr double kImpossible_rad = 5 * kDegree;

// Lengths that count as one standard deviation.
constexpr double kContact_m = 10e-3;
constexpr double kPlace_m = 5e-3;

constexpr double kMaxOverlap_m = 3e-3;  // pads give way by this much

// [parameter] in units of its prior standard deviation.
using Parameters = Eigen::Vector<double, kParameters>;

ThumbMap map_of(const Parameters& u) {
  ThumbMap map;
  for (std::size_t i = 0; i < kThumbAngles.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 * i);
    map.gain[i] += kGainSigma[i] * u[at];
    map.offset_rad[i] = kOffsetSigma_deg[i] * kDegree * u[at + 1];
  }
  return map;
}

double gap_of_bones(const HandGeometry& geometry, const HandPose& pose, int first_bone,
                    int finger) {
  double least_m = 1.0;
  for (int a = first_bone; a < kFingerJoints; ++a) {
    for (int joint = 0; joint < kFingerJoints; ++joint) {
      const int b = kFingerJoints * finger + joint;
      const Closest closest =
          closest_points(pose.from_m[a], pose.to_m[a], pose.from_m[b], pose.to_m[b]);
      least_m = std::min(least_m, closest.apart.norm() - geometry.fingers[0].radius_m[a] -
                                      geometry.fingers[finger].radius_m[joint]);
    }
  }
  return least_m;
}

// Where a thumb can be: not deep in a finger, not through the palm, not behind the hand.
void add_place(const HandGeometry& geometry, const HandPose& pose, std::vector<double>& residuals) {
  for (int finger = kIndex; finger < kFingers; ++finger) {
    const double gap_m = gap_of_bones(geometry, pose, 1, finger);
    residuals.push_back(std::min(gap_m + kMaxOverlap_m, 0.0) / kPlace_m);
  }
  constexpr double kHalfPalm_m = 30e-3;
  constexpr double kKnuckles_m = 95e-3;
  constexpr double kPalm_m = -22e-3;  // the palm's skin with half a thumb before it
  constexpr double kBack_m = 5e-3;
  const Eigen::Vector3d& tip_m = pose.to_m[kFingerJoints - 1];
  const double over_palm = std::clamp(1.0 - std::abs(tip_m.x()) / kHalfPalm_m, 0.0, 1.0) *
                           std::clamp((kKnuckles_m - tip_m.z()) / kHalfPalm_m, 0.0, 1.0);
  residuals.push_back(over_palm * std::max(tip_m.y() - kPalm_m, 0.0) / kPlace_m);
  residuals.push_back(std::max(tip_m.y() - kBack_m, 0.0) / kPlace_m);
}

void add_pose(const HandGeometry& geometry, const ThumbMap& map, const ThumbPose& measured,
              std::vector<double>& residuals) {
  constexpr double kBeside_m = 38e-3;
  constexpr double kStretched_m = 80e-3;
  HandAngles angles = measured.angles;
  map.apply(angles);
  for (std::size_t i = 0; i < kThumbAngles.size(); ++i) {
    const double angle_rad = angles[kThumbAngles[i]];
    const double possible_rad = std::clamp(angle_rad, kPossible[i].min_rad, kPossible[i].max_rad);
    residuals.push_back((angle_rad - possible_rad) / kImpossible_rad);
  }
  HandPose pose;
  place(geometry, angles, pose);
  for (int finger = kIndex; finger < kFingers; ++finger) {
    if (measured.touched[finger]) {
      residuals.push_back(gap_of_bones(geometry, pose, 2, finger) / kContact_m);
    }
  }
  add_place(geometry, pose, residuals);
  const double out_m = pose.to_m[kFingerJoints - 1].x();
  if (measured.stretched) residuals.push_back(std::max(kStretched_m - out_m, 0.0) / kPlace_m);
  if (measured.beside) {
    residuals.push_back(std::max(kBeside_m - out_m, 0.0) / kPlace_m);
    residuals.push_back(gap_of_bones(geometry, pose, 1, kIndex) / kContact_m);
  }
}

Eigen::VectorXd residuals_at(const HandGeometry& geometry, std::span<const ThumbPose> poses,
                             const Parameters& u) {
  const ThumbMap map = map_of(u);
  std::vector<double> residuals;
  for (const ThumbPose& pose : poses) add_pose(geometry, map, pose, residuals);
  for (const double one : u) residuals.push_back(kPriorWeight * one);
  return Eigen::Map<const Eigen::VectorXd>(residuals.data(), std::ssize(residuals));
}

// Levenberg and Marquardt from `u`; returns half of the sum of squares.
double descend(const HandGeometry& geometry, std::span<const ThumbPose> poses, Parameters& u) {
  constexpr int kMaxSteps = 60;
  constexpr double kDelta = 1e-5;
  Eigen::VectorXd r = residuals_at(geometry, poses, u);
  double damping = 1e-2;
  for (int step = 0; step < kMaxSteps && damping < 1e8; ++step) {
    Eigen::MatrixXd slope(r.size(), kParameters);
    for (Eigen::Index i = 0; i < kParameters; ++i) {
      Parameters moved = u;
      moved[i] += kDelta;
      slope.col(i) = (residuals_at(geometry, poses, moved) - r) / kDelta;
    }
    Eigen::MatrixXd normal = slope.transpose() * slope;
    normal.diagonal() *= 1.0 + damping;
    Parameters next = u;
    next -= normal.ldlt().solve(slope.transpose() * r);
    const Eigen::VectorXd there = residuals_at(geometry, poses, next);
    const double won = r.squaredNorm() - there.squaredNorm();
    damping *= won > 0.0 ? 0.3 : 8.0;
    if (!(won > 0.0)) continue;
    u = next;
    r = there;
    if (won < 1e-7 * r.squaredNorm()) break;
  }
  return 0.5 * r.squaredNorm();
}

}  // namespace

void ThumbMap::apply(HandAngles& angles) const noexcept {
  for (std::size_t i = 0; i < kThumbAngles.size(); ++i) {
    double& angle_rad = angles[kThumbAngles[i]];
    angle_rad = gain[i] * angle_rad + offset_rad[i];
  }
}

ThumbMap fit_thumb(const HandShape& shape, std::span<const ThumbPose> poses) {
  // Descents end in one of several valleys: a thumb on the wrong side finds no way back over the
  // palm.
  constexpr int kStarts = 12;
  constexpr double kSpread = 0.8;
  const HandGeometry geometry = hand_geometry(shape);
  ThumbMap best;
  double least = 0.0;
  PortableRandom random(1);
  for (int start = 0; start < kStarts; ++start) {
    Parameters u = Parameters::Zero();
    if (start > 0) {
      for (double& one : u) one = kSpread * random.normal();
    }
    const double cost = descend(geometry, poses, u);
    if (start > 0 && cost >= least) continue;
    best = map_of(u);
    least = cost;
  }
  return best;
}

double thumb_gap_m(const HandGeometry& geometry, const HandAngles& angles, int finger) {
  HandPose pose;
  place(geometry, angles, pose);
  return gap_of_bones(geometry, pose, 1, finger);
}

}  // namespace posed::hand
