#include "drivers/landmarks/fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::drivers::landmarks {
namespace {

constexpr double kPi_rad = std::numbers::pi;

// Landmark of a finger's joint, 0 to 2, or tip, 3.
RT_SAFE constexpr std::size_t landmark(int finger, int joint) noexcept {
  return 1 + 4 * static_cast<std::size_t>(finger) + static_cast<std::size_t>(joint);
}

RT_SAFE double wrapped(double angle_rad) noexcept { return unwrap_near(angle_rad, 0.0); }

// The angle beyond the range [rad], the shorter way round; 0 within it.
RT_SAFE double beyond(double angle_rad, const AngleRange& range) noexcept {
  if (angle_rad >= range.min_rad && angle_rad <= range.max_rad) return 0.0;
  return std::min(std::abs(wrapped(angle_rad - range.min_rad)),
                  std::abs(wrapped(angle_rad - range.max_rad)));
}

// The angle, or the nearer end of its range.
RT_SAFE double limited(double angle_rad, const AngleRange& range) noexcept {
  for (const double turn : {0.0, 2.0 * kPi_rad, -2.0 * kPi_rad}) {
    const double same = angle_rad + turn;
    if (same >= range.min_rad && same <= range.max_rad) return same;
  }
  const bool low =
      std::abs(wrapped(angle_rad - range.min_rad)) < std::abs(wrapped(angle_rad - range.max_rad));
  return low ? range.min_rad : range.max_rad;
}

RT_SAFE Eigen::Quaterniond turn_of(const std::array<double, 3>& angles) noexcept {
  return axis_rotation(Axis::kZ, angles[2]) * axis_rotation(Axis::kX, angles[0]) *
         axis_rotation(Axis::kY, angles[1]);
}

// Zero for a bone without a length.
RT_SAFE Eigen::Vector3d direction(const Eigen::Vector3d& bone_m) noexcept {
  const double length_m = bone_m.norm();
  return length_m > 0.0 ? Eigen::Vector3d(bone_m / length_m) : Eigen::Vector3d::Zero();
}

// The hinge angle about x that turns `from` towards `to`, as seen along x.
RT_SAFE double hinge(const Eigen::Vector3d& from, const Eigen::Vector3d& to) noexcept {
  return std::atan2(from.y() * to.z() - from.z() * to.y(), from.y() * to.y() + from.z() * to.z());
}

// Both spreads s with which Ry(s) v has the coordinate of d along the outer axis, which does not
// change it; the nearest ones if none has.
RT_SAFE std::array<double, 2> spreads(Axis outer, const Eigen::Vector3d& v,
                                      const Eigen::Vector3d& d) noexcept {
  const double reach = std::max(std::hypot(v.x(), v.z()), 1e-9);
  const double phase = std::atan2(v.x(), v.z());
  if (outer == Axis::kX) {  // cos s vx + sin s vz = reach sin(s + phase)
    const double sum = std::asin(std::clamp(d.x() / reach, -1.0, 1.0));
    return {wrapped(sum - phase), wrapped(kPi_rad - sum - phase)};
  }
  const double sum = std::acos(std::clamp(d.z() / reach, -1.0, 1.0));  // reach cos(s + phase)
  return {wrapped(sum - phase), wrapped(-sum - phase)};
}

}  // namespace

HandFit::HandFit(const HandShape& shape) {
  palm_m_[0] = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_m = Eigen::Vector3d::Zero();
  for (std::size_t k = 1; k < kPalmPoints; ++k) palm_m_[k] = shape.fingers[k].base_m;
  for (const auto& point_m : palm_m_) mean_m += point_m / double{kPalmPoints};
  for (auto& point_m : palm_m_) point_m -= mean_m;
  for (int f = 0; f < kFingers; ++f) {
    const FingerShape& form = shape.fingers[f];
    Digit& digit = digits_[f];
    digit.outer = f == 0 ? Axis::kZ : Axis::kX;
    digit.range = form.range;
    for (int j = 0; j < kFingerJoints; ++j) {
      digit.frame[j] = channel_frame(Side::kRight, shape, f, j);
      digit.straight[j] = digit.frame[j].conjugate() * (form.frame * Eigen::Vector3d::UnitZ());
    }
  }
}

// The rotation from the wrist's frame to that of the points: the eigenvector of the largest
// eigenvalue of a symmetric matrix of their products (Davenport; Horn 1987).
RT_SAFE bool HandFit::palm_of(const std::array<Eigen::Vector3d, kLandmarks>& point_m,
                              Eigen::Quaterniond& palm) const noexcept {
  constexpr double kMinArea = 0.02;  // of the parallelogram's sides' product: a line has none
  const Eigen::Vector3d to_index_m = point_m[landmark(1, 0)] - point_m[0];
  const Eigen::Vector3d to_little_m = point_m[landmark(4, 0)] - point_m[0];
  const double sides_m2 = to_index_m.norm() * to_little_m.norm();
  if (!(to_index_m.cross(to_little_m).norm() > kMinArea * sides_m2)) return false;
  Eigen::Matrix3d product = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < kPalmPoints; ++k) {
    const std::size_t at = k == 0 ? 0 : landmark(static_cast<int>(k), 0);
    product += palm_m_[k] * (point_m[at] - point_m[0]).transpose();
  }
  const Eigen::Vector3d skew(product(1, 2) - product(2, 1), product(2, 0) - product(0, 2),
                             product(0, 1) - product(1, 0));
  Eigen::Matrix4d quadratic;
  quadratic(0, 0) = product.trace();
  quadratic.block<3, 1>(1, 0) = skew;
  quadratic.block<1, 3>(0, 1) = skew.transpose();
  quadratic.block<3, 3>(1, 1) =
      product + product.transpose() - product.trace() * Eigen::Matrix3d::Identity();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(quadratic);
  if (solver.info() != Eigen::Success) return false;
  const Eigen::Vector4d best = solver.eigenvectors().col(3);
  palm = Eigen::Quaterniond(best[0], best[1], best[2], best[3]).normalized();
  return true;
}

// Of the two solutions, the one within the limits; then that in whose plane the bones after it
// bend.
RT_SAFE HandFit::Angles HandFit::first_joint(const Digit& digit, const Bones& bones) noexcept {
  const Eigen::Quaterniond back = digit.frame[0].conjugate();
  const Eigen::Vector3d d = back * bones[0];
  const auto outer = static_cast<std::size_t>(digit.outer);
  Angles best{};
  double least = std::numeric_limits<double>::infinity();
  for (const double spread : spreads(digit.outer, digit.straight[0], d)) {
    const Eigen::Vector3d w = axis_rotation(Axis::kY, spread) * digit.straight[0];
    Angles angles{0.0, spread, 0.0};
    angles[outer] = digit.outer == Axis::kX
                        ? hinge(w, d)
                        : std::atan2(w.x() * d.y() - w.y() * d.x(), w.x() * d.x() + w.y() * d.y());
    const Eigen::Quaterniond turned = digit.frame[0] * turn_of(angles) * back * digit.frame[1];
    double cost = 1e-9 * (angles[outer] * angles[outer] + spread * spread);
    for (const std::size_t axis : {outer, std::size_t{1}}) {
      const double over = beyond(angles[axis], digit.range[0][axis]);
      cost += 4.0 * over * over;
    }
    for (std::size_t j = 1; j < kFingerJoints; ++j) {
      const double aside = (turned.conjugate() * bones[j]).x();
      cost += aside * aside;
    }
    if (cost < least) {
      least = cost;
      best = angles;
    }
  }
  return best;
}

RT_SAFE void HandFit::fit_digit(const Digit& digit, const Bones& bones, double* angles) noexcept {
  Eigen::Quaterniond before = Eigen::Quaterniond::Identity();  // of the bone before, in the wrist's
  for (std::size_t j = 0; j < kFingerJoints; ++j) {
    const Eigen::Quaterniond& frame = digit.frame[j];
    const Eigen::Vector3d d = (before * frame).conjugate() * bones[j];
    Angles joint{};
    if (j == 0) joint = first_joint(digit, bones);
    if (j > 0) joint[0] = hinge(digit.straight[j], d);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      joint[axis] = limited(joint[axis], digit.range[j][axis]);
      angles[3 * j + axis] = joint[axis];
    }
    before = before * frame * turn_of(joint) * frame.conjugate();
  }
}

RT_SAFE bool HandFit::angles_of(Side side, const Landmarks& point_m,
                                HandAngles& angles) const noexcept {
  // A left hand is the mirror image of a right one, with the same angles.
  std::array<Eigen::Vector3d, kLandmarks> right_m;
  for (std::size_t k = 0; k < kLandmarks; ++k) {
    const Vec3f& p = point_m[k];
    right_m[k] = mirrored(side, Eigen::Vector3f(p.data()).cast<double>());
  }
  Eigen::Quaterniond palm;
  if (!palm_of(right_m, palm)) return false;
  for (int f = 0; f < kFingers; ++f) {
    Bones bones;
    for (int j = 0; j < kFingerJoints; ++j) {
      bones[j] =
          palm.conjugate() * direction(right_m[landmark(f, j + 1)] - right_m[landmark(f, j)]);
    }
    fit_digit(digits_[f], bones, &angles[static_cast<std::size_t>(f) * kFingerChannels]);
  }
  return true;
}

Landmarks landmarks_of(const Skeleton& hand, const Frame& frame) {
  Landmarks point_m{};
  std::array<Eigen::Vector3d, kHandSkeletonJoints> place_m;
  std::array<Eigen::Quaterniond, kHandSkeletonJoints> turn;
  const auto keep = [&](std::size_t at, const Eigen::Vector3d& p) {
    for (int i = 0; i < 3; ++i) point_m[at][i] = static_cast<float>(p[i]);
  };
  place_m[0].setZero();
  turn[0].setIdentity();
  for (int f = 0; f < kFingers; ++f) {
    for (int j = 0; j < kFingerJoints; ++j) {
      const int at = hand_joint(f, j);
      const Joint& joint = hand.joints[at];
      place_m[at] = place_m[joint.parent] + turn[joint.parent] * joint.offset_m;
      turn[at] = turn[joint.parent] * to_eigen_double(frame.rotation_xyzw[at]);
      keep(landmark(f, j), place_m[at]);
      if (joint.end_site_m) keep(landmark(f, j + 1), place_m[at] + turn[at] * *joint.end_site_m);
    }
  }
  return point_m;
}

}  // namespace posed::drivers::landmarks
