// StyleFilter: the style stage of one stream, y = q + alpha f(q) (README.md, "Filter"), with the
// same code live, offline (`apply`) and in replay. Memoryless but for what makes it safe to touch
// while it runs: the heading low-pass, the alpha slew, the gate's smoothing and the blend after a
// model swap. The bound on the step (README.md, "Bound on the step"). Let D(t) = R_in^T R_out be
// what the filter adds to a joint at frame t. Then
//
//   angle(D(t-1), D(t)) <= |c| slew dt + the change of the model's own answer from t-1 to t,
//
// where the model's own answer has its alpha moved by at most slew dt, and c is the rotation vector
// between what went out at the last swap and what the new model would have said there (|c| <= pi;
// 0 when no swap lies less than 1 / slew back). So neither a swap, nor a swap within the blend of
// another, nor a change of alpha, nor a walker who is put elsewhere makes the pose jump.
//
// Time is the frames': their device time where they have one, else their arrival. A step back
// counts as none, a gap as at most 0.1 s.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "models/gp/predictor.hpp"
#include "models/motion/pose_space.hpp"
#include "models/stage.hpp"
#include "models/style/heading.hpp"
#include "models/style/style_model.hpp"

namespace posed::style {

// A model bound to one skeleton and ready for hot use. Built cold, then const; the hot side gets a
// plain pointer and hands the old one back to be freed.
struct BoundModel {
  motion::PoseSpace space;
  gp::Predictor predictor;
  Eigen::VectorXf limit_rad, input_mean, input_sd;  // [dims]
  std::string name;
};

struct FilterOptions {
  double alpha = 1.0;  // -2..2
  double alpha_slew_per_s = 2.0;
  bool gate = false;           // fade towards fallback * constant where the process knows nothing
  double gate_fallback = 1.0;  // kappa_c (README.md, "Filter")
  bool calibrate = false;      // remove the walker's own mean offset from the kernel's input
};
inline constexpr double kMaxAlpha = 2.0;

// Refuses a skeleton that lacks joints of the model's pose space, naming them, and a model whose
// parts do not fit each other.
[[nodiscard]] Result<std::unique_ptr<const BoundModel>> bind_model(const StyleModel& model,
                                                                   const Skeleton& skeleton,
                                                                   const FilterOptions& options,
                                                                   std::string name);

class StyleFilter final : public Stage {
 public:
  // `model` outlives its use here; null passes frames through until the first set_model.
  StyleFilter(const BoundModel* model, const FilterOptions& options) noexcept;

  // Emits one frame for each frame in, with its header, quality and variance. A joint
  // whose quaternion is not finite or has no length comes out as not measured. RT-safe.
  void process(const StageFrame& in, StageOut& out) noexcept override;

  // Both take effect at the next frame; RT-safe. Alpha is clamped to +-2, one that is not a number
  // is ignored. set_model returns the old pointer, which is no longer read; `model` is not null (to
  // switch styling off, set alpha to 0).
  void set_alpha(float alpha) noexcept;
  [[nodiscard]] const BoundModel* set_model(const BoundModel* model) noexcept;

  // Starts from the settled state that this frame would lead to (offline use): full alpha, heading
  // found.
  void settle(const Frame& frame, double heading_rad) noexcept;

  [[nodiscard]] float alpha() const noexcept;  // where the slew is now
  [[nodiscard]] float alpha_target() const noexcept { return static_cast<float>(alpha_target_); }

 private:
  using Dims = std::array<float, motion::kMaxPoseDims>;
  using Flags = std::array<std::uint8_t, motion::kMaxPoseDims>;
  using Rotations = std::array<Quatf, kMaxJoints>;

  double elapsed_s(const Frame& frame) noexcept;
  void style(Frame& frame, double dt_s) noexcept;
  void answer(const Dims& q, const Flags& available, double dt_s, Dims& delta) noexcept;
  float smoothed_gate(float confidence, double dt_s) noexcept;
  void kernel_input(const Dims& q, const Flags& available, double dt_s, Dims& input) noexcept;
  void begin_blend(const Rotations& in, const Frame& styled, double dt_s) noexcept;
  void blend(Frame& styled) const noexcept;

  const BoundModel* model_;
  FilterOptions options_;
  double alpha_ = 0.0;
  double alpha_target_ = 0.0;
  std::int64_t last_ns_ = kNoTime_ns;
  Heading heading_;
  float gate_ = -1.0F;  // smoothed confidence; below 0 before the first
  Dims offset_{};       // of the walker's mean pose from the training's, for `calibrate`

  // The blend: R_out = R_styled exp(weight c) per joint.
  bool discontinuity_ = false;  // the next frame begins one
  double blend_weight_ = 0.0;
  int last_joints_ = 0;  // of the last frame that went out; 0 when there was none
  std::array<Vec3f, kMaxJoints> blend_from_{};
  Rotations last_in_{}, last_out_{};
};

}  // namespace posed::style
