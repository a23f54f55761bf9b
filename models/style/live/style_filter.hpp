// StyleFilter: the style stage of one stream, y = q + alpha g f(q) (models/style/README.md,
// "Filter"), with the same code live, offline (`apply`) and in replay. The change has no memory of
// the pose; its only state is the heading low-pass, alpha, weights and mask on their way, the gate
// g and the blend after a model swap, which allow changes while it runs.
//
// Continuity bound (models/style/README.md, "Bound on the step"): let D(t) = R_in^T R_out be what
// the filter adds to a joint at frame t. Then
//
//   angle(D(t-1), D(t)) <= |c| slew dt + the change of the model delta from t-1 to t,
//
// where per frame alpha in the model delta moves by at most slew dt, at most slew dt of the mixture
// of styles changes (style_weights.hpp) and each part's factor moves by at most slew dt
// (body_mask.hpp), and c is the rotation vector between the rotation emitted at the last swap and
// the one that the new model would have given there (|c| <= pi; 0 when the last swap was more than
// 1 / slew ago). So no swap, no swap within the blend of another, no change of alpha, weights or
// mask and no jump of the source makes the pose jump.
//
// Time is taken from the frames: their device time where they have one, else their arrival time. A
// step back in time counts as 0 s, a gap as at most 0.1 s.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "models/elapsed.hpp"
#include "models/motion/heading.hpp"
#include "models/motion/pose_space.hpp"
#include "models/parameter_table.hpp"
#include "models/stage.hpp"
#include "models/style/live/alpha_reach.hpp"
#include "models/style/live/body_mask.hpp"
#include "models/style/live/bound_model.hpp"
#include "models/style/live/style_weights.hpp"
#include "models/style/live/walker_tracker.hpp"

namespace posed::style {

struct FilterOptions {
  double alpha = 1.0;  // -2..2
  double alpha_slew_per_s = 2.0;
  bool gate = true;            // fade out where the model does not know the motion
  double gate_fallback = 0.0;  // how much of the model's constant part is left there
  // Less style for who shows it already (models/style/README.md, "Auto-alpha").
  bool auto_alpha = false;
  std::string weights{};     // of the styles (shares_of()); empty: the first one alone
  Mask mask = whole_body();  // of the parts of the body
};
inline constexpr double kUsualWarmUp_s = 10.0;
inline constexpr double kMinWarmUp_s = 2.0;
inline constexpr double kMaxWarmUp_s = 600.0;

class StyleFilter final : public Stage {
 public:
  // `model` is not owned and must outlive its use here; with null, frames pass through until the
  // first set_model. Weights that the model does not have, see shares_of(), count as none. Of
  // bodies with `skeleton` the style fades out when the model is taken away; null: it ends at once.
  StyleFilter(const BoundModel* model, const FilterOptions& options,
              std::shared_ptr<const Skeleton> skeleton = nullptr) noexcept;

  // Emits one frame for each frame in, with its header, quality and variance. A joint
  // whose quaternion is not finite or has no length comes out as not measured.
  RT_SAFE void process(const StageFrame& in, StageOut& out) noexcept override;

  // All take effect at the next frame; Alpha is clamped to +-2; NaN is ignored. set_model
  // returns the old pointer, which is no longer read; with null the style fades out. Weights stay
  // with the names of their styles. set_shares returns false for shares of another model.
  RT_SAFE void set_alpha(float alpha) noexcept;
  [[nodiscard]] bool set_shares(const Shares& shares) noexcept;
  void set_mask(const Mask& mask) noexcept { mask_.aim(mask); }
  [[nodiscard]] const BoundModel* set_model(const BoundModel* model) noexcept;

  // Starts in the settled state (offline use): full alpha, known heading, and of gate and busy
  // limbs what preview() has seen.
  void settle(const motion::LiveHeading& heading) noexcept;
  // Lets the gate, the limbs and the estimate see a frame `dt_s` from the one before, in either
  // direction of time.
  void preview(const Frame& frame, const motion::LiveHeading& heading, double dt_s) noexcept;

  // How much the gate passes, 0 to 1; NaN while it is off or the model has no data for it.
  RT_SAFE [[nodiscard]] double gate() const noexcept;
  // How much of the style the walker shows already; NaN: unknown.
  RT_SAFE [[nodiscard]] double estimate() const noexcept { return tracker_.estimate(); }
  // Offline: the walker is known from elsewhere; what a warm-up has found.
  void set_walker(const Walker& walker) noexcept { tracker_.set_walker(walker); }
  [[nodiscard]] const std::optional<Walker>& walker() const noexcept { return tracker_.walker(); }

  // Readings, notices and commands, as style_type() numbers them. RT-safe.
  enum Reading : std::size_t { kStyleEstimate, kStyleGate };
  [[nodiscard]] double reading(std::size_t reading) const noexcept override;
  static constexpr std::size_t kAlphaHeld =
      WalkerTracker::kNoAxis + 1;  // after the tracker's notices
  static constexpr std::size_t kHingeHeld = kAlphaHeld + 1;
  [[nodiscard]] std::optional<StageNotice> take_notice() noexcept override;
  enum Command : std::size_t { kWarmUp, kWeights, kMask, kNeutral };
  [[nodiscard]] bool command(std::size_t index, const StageCommand& command) noexcept override;
  void flush(StageOut& /*out*/) noexcept override { tracker_.interrupt(); }

  // The parameters, as style_type() numbers them. set() and state() are RT-safe.
  using Table = ParameterTable<FilterOptions, StyleFilter>;
  static const Table& table();
  void set(std::size_t parameter, double value) noexcept override {
    table_.set(*this, options_, parameter, value);
  }
  [[nodiscard]] ParameterState state(std::size_t parameter) const noexcept override {
    return table_.state(*this, options_, parameter);
  }
  bool use(const StageModel* model) noexcept override;
  [[nodiscard]] const BoundModel* model() const noexcept override { return model_; }

  void describe(std::size_t index, const StageCommand& command,
                ShortText& text) const noexcept override;

  [[nodiscard]] float alpha() const noexcept;  // the current value, while it slews
  // Whether a knee or an elbow was kept from bending the wrong way.
  [[nodiscard]] bool hinge_held() const noexcept { return hinge_held_; }
  [[nodiscard]] const StyleWeights& weights() const noexcept { return weights_; }
  [[nodiscard]] const BodyMask& mask() const noexcept { return mask_; }
  [[nodiscard]] float alpha_target() const noexcept { return static_cast<float>(alpha_target_); }
  // The same within what the arms allow (alpha_reach.hpp).
  [[nodiscard]] double held_alpha() const noexcept {
    return std::clamp(alpha_target_, reach_.low, reach_.high);
  }

 private:
  using Dims = std::array<float, motion::kMaxPoseDims>;
  using Flags = std::array<std::uint8_t, motion::kMaxPoseDims>;
  using Rotations = std::array<Quatf, kMaxJoints>;
  using Root = Eigen::Vector3f;  // RootFunction

  // A frame in the model's pose space, and as its kernel sees it.
  struct Pose {
    Dims q, input;
    Flags available;
  };

  void style(Frame& frame, double dt_s) noexcept;
  void fade_out(Frame& frame, double dt_s) noexcept;
  const BoundModel* take_away() noexcept;
  [[nodiscard]] std::span<const float> shares_to_ask() noexcept;
  void mix_limits() noexcept;
  void look_at_reach() noexcept;
  bool read_pose(const Frame& frame, double dt_s, Pose& pose) noexcept;
  void change(const Rotations& in, const Pose& pose, Frame& frame) noexcept;
  void answer(const Pose& pose, Dims& delta, Dims& shares) noexcept;
  void limit_root(const float* change) noexcept;
  void change_root() noexcept;
  void set_alpha_number(double value) noexcept { set_alpha(static_cast<float>(value)); }
  [[nodiscard]] ParameterState alpha_state() const noexcept { return {alpha_, wanted_alpha()}; }
  void set_gate(double on) noexcept { tracker_.set_gate(on != 0.0); }
  void set_gate_fallback(double value) noexcept;
  void set_auto_alpha(double on) noexcept { tracker_.set_auto_alpha(on != 0.0); }
  void find_missing() noexcept;
  [[nodiscard]] double wanted_alpha() const noexcept;
  void begin_blend(const Rotations& in, const Frame& styled, double dt_s) noexcept;
  void blend(const Skeleton& skeleton, Frame& styled) const noexcept;

  const Table& table_ = table();
  const BoundModel* model_;
  std::shared_ptr<const Skeleton> skeleton_;  // of the stream; may be null
  bool leaving_ = false;                      // the style fades out: there is no model any more
  RootChange leaving_root_;                   // what it began with
  FilterOptions options_;
  double alpha_ = 0.0;
  double alpha_target_ = 0.0;
  double missing_ =
      1.0;  // share of the style that the walker does not show already; 1: no auto_alpha
  StyleWeights weights_;
  BodyMask mask_;
  Dims limit_rad_{};  // of the mixture
  AlphaReach reach_;  // the same
  bool is_held_ = false, tell_held_ = false;
  bool hinge_held_ = false, tell_hinge_ = false;  // told once a model
  Root limit_root_ = Root::Zero();
  Root root_ = Root::Zero();       // the model's change at this frame
  Root root_from_ = Root::Zero();  // what a blend begins with, less the model's change
  Root last_root_ = Root::Zero();  // as it was emitted
  RootChange root_change_;         // the same, in metres and the world
  Elapsed elapsed_;
  motion::LiveHeading heading_;
  double gap_s_ = 0.0;  // between the last two frames
  WalkerTracker tracker_;

  // The blend: R_out = R_styled exp(weight c) per joint.
  bool discontinuity_ = false;  // the next frame begins a blend
  double blend_weight_ = 0.0;
  int last_joints_ = 0;  // of the last emitted frame; 0 when there was none
  std::array<Vec3f, kMaxJoints> blend_from_{};
  Rotations last_in_{}, last_out_{};
};

}  // namespace posed::style
