// LegMap: what a cycle's body does at this instant, told by the legs alone: a small Gaussian
// process from the legs' part of a pose, on the points of one mean cycle (models/style/README.md,
// "Warm-up"). It needs no phase, is smooth everywhere, and gives the cycle's mean where the legs do
// something else. RT-safe.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include <Eigen/Core>

#include "models/motion/pose_space.hpp"
#include "models/style/model/harmonics.hpp"

namespace posed::style {

// Poses on the points of a cycle, phase 0 first.
using PoseCycle = Eigen::Matrix<float, kGridFrames, Eigen::Dynamic, Eigen::ColMajor, kGridFrames,
                                motion::kMaxPoseDims>;

class LegMap {
 public:
  // `legs`: dimensions of the legs in a pose, borrowed. `at` tells the legs at each point, `values`
  // what belongs to it; both have as many columns as a pose.
  void fit(std::span<const std::uint16_t> legs, const PoseCycle& at,
           const PoseCycle& values) noexcept;

  // What belongs to the legs of pose q, into `out`, which may not be q. Legs that were not measured
  // do not count; without any, the mean.
  void get(std::span<const float> q, std::span<const std::uint8_t> available,
           std::span<float> out) const noexcept;

 private:
  using Column = Eigen::Array<float, kGridFrames, 1>;

  std::span<const std::uint16_t> legs_;
  PoseCycle at_;       // the legs' columns alone
  PoseCycle weights_;  // of the values about their mean
  Eigen::Matrix<float, 1, Eigen::Dynamic, Eigen::RowMajor, 1, motion::kMaxPoseDims> mean_;
  float exponent_ = 0.0F;
};

}  // namespace posed::style
