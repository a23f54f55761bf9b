// CameraRig: what the P5's feature reports say about its camera heads and LEDs, and where a hand is
// by them. Metres, in the rig's frame as libp5glove has it: x to one side, y up, z away from it.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <bitset>
#include <cstddef>
#include <span>

#include "drivers/p5/protocol.hpp"

namespace posed::drivers::p5 {

struct CameraRig {
  double tilt1_rad = 0.0, tilt2_rad = 0.0;   // of the heads that give v1 and v2
  double distance_m = 0.0;                   // between the heads
  std::array<Eigen::Vector3d, kLeds> led_m;  // in the hand's frame

  // Of feature reports 6 and 12, whole. Cold.
  [[nodiscard]] static CameraRig of(std::span<const std::byte, kHeadsBytes> heads,
                                    std::span<const std::byte, kLedsBytes> leds);

  // Where a LED is, of unwrapped values; false where the heads' lines do not meet in front of them.
  // RT-safe.
  [[nodiscard]] bool locate(const LedObservation& spot, Eigen::Vector3d& position_m) const noexcept;
  // How the heads see it, values not wrapped; for what is in front of them.
  [[nodiscard]] LedObservation project(std::size_t led, const Eigen::Vector3d& position_m) const;
};

struct RigidPose {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  // of the LEDs' origin
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

// The hand that fits three or more seen LEDs; false when fewer agree with each other's distances
// (20 %). RT-safe.
[[nodiscard]] bool fit_hand(const CameraRig& rig,
                            const std::array<Eigen::Vector3d, kLeds>& position_m,
                            std::bitset<kLeds> seen, RigidPose& place) noexcept;

}  // namespace posed::drivers::p5
