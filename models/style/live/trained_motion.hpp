// TrainedMotion: the motion that a model was trained on, bound to one skeleton: how far a pose is
// from the nearest one of training, and how the legs strode there (models/style/README.md, "Gate").
// Const and shareable.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "models/gp/kernel.hpp"
#include "models/motion/leg_signal.hpp"
#include "models/style/live/body_mask.hpp"
#include "models/style/model/style_model.hpp"

namespace posed::style {

class TrainedMotion {
 public:
  // For a model with gate data (GateData::present()) whose parts fit each other. Cold.
  TrainedMotion(const StyleModel& model, const Skeleton& skeleton);

  // From q [dims] to the nearest of the kept training poses: the rotation, rms over joints [deg],
  // and the same for each of `parts` [dims] alone, 0 where none of it was measured. Missing
  // dimensions count as those that are there; NaN where none is.
  using PartDistances = std::array<float, kLooseParts>;
  struct Distances {
    double whole_deg;
    PartDistances part_deg;
  };
  [[nodiscard]] Distances distances_deg(std::span<const float> q,
                                        std::span<const std::uint8_t> available,
                                        std::span<const LoosePart> parts) const noexcept;
  RT_SAFE [[nodiscard]] double distance_deg(std::span<const float> q,
                                            std::span<const std::uint8_t> available) const noexcept;

  // The rotation from one pose to another [dims], rms over joints [deg]; missing dimensions as
  // above.
  [[nodiscard]] double turn_deg(std::span<const float> from, std::span<const float> to,
                                std::span<const std::uint8_t> available) const noexcept;

  // Empty where the training showed no strides or the skeleton names no upper legs.
  [[nodiscard]] const std::optional<motion::LegSignal>& legs() const noexcept { return legs_; }
  [[nodiscard]] double swing_rad() const noexcept { return swing_rad_; }
  [[nodiscard]] double cadence_rad_s() const noexcept { return cadence_rad_s_; }
  // LiveGait's correlation in the training; NaN: unknown.
  [[nodiscard]] double gait_correlation() const noexcept { return gait_correlation_; }
  // Height of the pelvis; NaN where the frame did not measure it.
  RT_SAFE [[nodiscard]] double height_m(const Frame& frame) const noexcept;

 private:
  [[nodiscard]] double rms_deg(float sum_rad2, int there, std::size_t dims) const noexcept;

  // At most this many poses, those that stand best for all: the others are within a few degrees.
  static constexpr int kPoses = 128;

  // One dimension of the poses of a tile, which the kernel reads: [dims] of one tile after the
  // other.
  struct alignas(64) Row {
    std::array<float, gp::kernel::kTile> pose;
  };
  std::vector<Row> rows_;
  double joints_;
  std::optional<motion::LegSignal> legs_;
  double swing_rad_, cadence_rad_s_;
  double gait_correlation_;
  std::size_t root_joint_;
};

}  // namespace posed::style
