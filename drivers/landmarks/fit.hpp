// HandFit: the hand45 angles of a hand's landmarks, in closed form. The palm's turn is that which
// lays wrist and knuckles onto those of the hand's shape (Kabsch). Then each bone's direction in
// the frame of the one before gives its joint's angles: flexion and spread of a finger's first
// joint, opposition and spread of a thumb's, and a hinge for each joint after it. What 21 points
// cannot tell stays zero: the twist of fingers, the flexion of a thumb's first joint. Points of a
// hand with such angles and the same shape give back its angles exactly.
#pragma once

#include <array>

#include <Eigen/Geometry>

#include "drivers/landmarks/protocol.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/hand_shape.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::drivers::landmarks {

class HandFit {
 public:
  // Cold.
  explicit HandFit(const HandShape& shape = default_hand_shape());

  // All angles are finite and within the shape's limits. False when wrist and knuckles lie on a
  // line, so that the palm has no turn.
  RT_SAFE [[nodiscard]] bool angles_of(Side side, const Landmarks& point_m,
                                       HandAngles& angles) const noexcept;

 private:
  static constexpr std::size_t kPalmPoints = 5;  // the wrist and four knuckles

  struct Digit {
    Axis outer = Axis::kX;  // turned first by its first joint, before the spread
    // [joint] in which its channels turn, and the straight bone's direction there.
    std::array<Eigen::Quaterniond, kFingerJoints> frame{};
    std::array<Eigen::Vector3d, kFingerJoints> straight{};
    std::array<std::array<AngleRange, 3>, kFingerJoints> range{};
  };
  using Bones = std::array<Eigen::Vector3d, kFingerJoints>;  // in the wrist's frame
  using Angles = std::array<double, 3>;                      // x, y, z of one joint

  [[nodiscard]] bool palm_of(const std::array<Eigen::Vector3d, kLandmarks>& point_m,
                             Eigen::Quaterniond& palm) const noexcept;
  static void fit_digit(const Digit& digit, const Bones& bones, double* angles) noexcept;
  [[nodiscard]] static Angles first_joint(const Digit& digit, const Bones& bones) noexcept;

  std::array<Eigen::Vector3d, kPalmPoints> palm_m_{};  // of the shape, about their mean
  std::array<Digit, kFingers> digits_{};
};

// The points of a posed hand, in its skeleton's frame. Cold.
[[nodiscard]] Landmarks landmarks_of(const Skeleton& hand, const Frame& frame);

}  // namespace posed::drivers::landmarks
