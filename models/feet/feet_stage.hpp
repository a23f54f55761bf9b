// FeetStage: makes the feet of a styled body stand where the performer's do (README.md). It needs
// the frame before the style beside the styled one, holds nothing back and looks at no later frame.
// One thread.
#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "models/elapsed.hpp"
#include "models/feet/contacts.hpp"
#include "models/feet/foot_hold.hpp"
#include "models/feet/legs.hpp"
#include "models/feet/root_motion.hpp"
#include "models/stage.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::feet {

class FeetStage final : public Stage {
 public:
  // Live parameters, in the order of feet_type().
  enum Parameter : std::size_t { kRoot, kLimit };

  // `rate_hz`: nominal, for frames without times; 0: unknown.
  FeetStage(std::shared_ptr<const Skeleton> skeleton, Legs legs, double rate_hz,
            const RootOptions& options) noexcept;

  // Emits one frame for each frame in. Frames of another skeleton, and frames whose unstyled
  // original is not known, pass through. RT-safe.
  void process(const StageFrame& in, StageOut& out) noexcept override;
  void set(std::size_t parameter, double value) noexcept override;
  [[nodiscard]] ParameterState state(std::size_t parameter) const noexcept override;

 private:
  [[nodiscard]] bool serves(const StageFrame& in) const noexcept;
  [[nodiscard]] double step_s(const Frame& frame, const Eigen::Vector3d& root_m) noexcept;
  [[nodiscard]] double gone(double dt_s) noexcept;
  void restart() noexcept;
  void forget() noexcept;
  [[nodiscard]] double lowest_sole_m(const Eigen::Vector3d& root_m) const noexcept;
  void hold(std::size_t leg, const Eigen::Vector3d& root_m, const Eigen::Vector3d& offset_m,
            double gone, double dt_s, Frame& frame) noexcept;

  std::shared_ptr<const Skeleton> skeleton_;
  Legs legs_;
  double nominal_s_;
  double least_s_;  // 0 where the rate is not known
  RootOptions options_;
  Elapsed elapsed_;
  LegPose performer_, avatar_;
  Contacts contacts_;
  RootMotion root_;
  std::array<FootHold, kLegs> holds_{};
  Eigen::Vector3d last_root_m_ = Eigen::Vector3d::Zero();
  bool seen_ = false;      // last_root_m_ is of the frame before
  double change_m_ = 0.0;  // how far the style moves a foot, with a slow fall
};

}  // namespace posed::feet
