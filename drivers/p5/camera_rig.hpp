// CameraRig: geometry of the P5's camera heads and LEDs from its feature reports, and the hand pose
// computed from it. Metres, in the rig's frame as in libp5glove: x to one side, y up, z away from
// it.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <bitset>
#include <cstddef>
#include <span>

#include "drivers/p5/protocol.hpp"

namespace posed::drivers::p5 {

struct CameraRig {
  double tilt1_rad = 0.0, tilt2_rad = 0.0;   // of the heads that measure v1 and v2
  double distance_m = 0.0;                   // between the heads
  std::array<Eigen::Vector3d, kLeds> led_m;  // in the hand's frame

  // Made from feature reports 6 and 12, whole. Cold.
  [[nodiscard]] static CameraRig of(std::span<const std::byte, kHeadsBytes> heads,
                                    std::span<const std::byte, kLedsBytes> leds);

  // Computes the position of a LED from unwrapped values; false when the lines of sight from the
  // heads do not meet in front of them.
  RT_SAFE [[nodiscard]] bool locate(const LedObservation& spot,
                                    Eigen::Vector3d& position_m) const noexcept;
  // The inverse of locate(): the values that the heads measure, unwrapped, for a LED in front of
  // them.
  [[nodiscard]] LedObservation project(std::size_t led, const Eigen::Vector3d& position_m) const;
};

struct RigidPose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  // of the origin of the LEDs' frame
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

// Computes the hand pose from the LEDs that were seen (Kabsch algorithm). Returns false when fewer
// than three of them have the right distances from two others (within 20 %), or all are on a line.
RT_SAFE [[nodiscard]] bool fit_hand(const CameraRig& rig,
                                    const std::array<Eigen::Vector3d, kLeds>& position_m,
                                    std::bitset<kLeds> seen, RigidPose& place) noexcept;

}  // namespace posed::drivers::p5
