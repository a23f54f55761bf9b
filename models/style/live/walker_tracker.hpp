// WalkerTracker: what the style stage measures of its walker: whether the model knows the
// motion (gate), the walker's own neutral pose (warm-up), and how much of the style it shows
// already. models/style/README.md has a section on each. State of one stream. RT-safe.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "models/stage.hpp"
#include "models/style/live/bound_model.hpp"
#include "models/style/live/live_motion.hpp"
#include "models/style/live/trained_motion.hpp"
#include "models/style/live/warm_up.hpp"
#include "proto/frame/frame.hpp"

namespace posed::style {

// How much of a model's style a walker shows already, from the mean pose of the last second
// (models/style/README.md, "Auto-alpha"). RT-safe.
class StyleEstimate {
 public:
  // Adds a pose that stood for `dt_s`; `place` is its place on the model's style axis.
  void update(double place, double dt_s) noexcept;
  void forget() noexcept { *this = {}; }

  // The mean place of the last second: 0 none of the style, 1 all of it, and beyond either, for it
  // is not clamped. NaN until half a second is known.
  [[nodiscard]] double value() const noexcept;

 private:
  struct Part {
    double sum_s = 0.0, time_s = 0.0;
  };
  // The parts of the last second, in a ring; each holds whole frames, so that slow streams have a
  // second, too.
  std::array<Part, 64> parts_{};
  std::size_t oldest_ = 0, count_ = 0;
  Part all_;
};

// Four low-passes in a row: the third derivative of what comes out is finite. RT-safe.
class Fade {
 public:
  void set(double value) noexcept { stage_.fill(value); }
  [[nodiscard]] double value() const noexcept { return stage_.back(); }
  // Advances by `dt_s`; `towards(share)` is what to follow at that share of it. In small steps, so
  // that it is the same at any rate of frames.
  template <typename Towards>
  void follow(double dt_s, const Towards& towards) noexcept {
    const int steps = std::max(1, static_cast<int>(std::ceil(dt_s / kStep_s)));
    const double part = -std::expm1(-dt_s / steps / kStage_s);
    for (int i = 0; i < steps; ++i) step(towards((i + 0.5) / steps), part);
  }

 private:
  static constexpr double kStage_s = 0.045;  // time constant of each
  static constexpr double kStep_s = 0.005;
  void step(double towards, double part) noexcept;

  std::array<double, 4> stage_{};
};

// Fades the style out where the model does not know the motion, and in again where it does
// (models/style/README.md, "Gate"). State of one stream. RT-safe.
class Gate {
 public:
  // How far a pose is from the nearest one of training [deg]: as the kernel sees it, and with what
  // busy limbs do; NaN where nothing of it was measured.
  struct Distance {
    double kernel_deg, whole_deg;
  };
  // Advances by a frame, `dt_s` after the last one. `q` is the pose that the kernel sees; `walker`:
  // this walker's measured neutral walk, if any. With `on` false or `known` null, as the model has
  // no data for the gate, the gate opens gradually, or at once if it was never on.
  void update(const TrainedMotion* known, bool on, const Frame& frame, std::span<const float> q,
              std::span<const std::uint8_t> available, const Distance& distance,
              const std::optional<Walker>& walker, double dt_s) noexcept;

  // How much style passes: 1 all, exactly, to 0 none, exactly; 0 before the first frame. It takes
  // about 0.17 s half of the way, and its third derivative is finite.
  [[nodiscard]] float open() const noexcept { return static_cast<float>(fade_.value()); }
  // Whether the legs stride as in training; true where that is unknown.
  [[nodiscard]] bool strides() const noexcept { return of_legs_ >= 0.5; }
  // Returns the cadence, low-passed; 0 while it is unknown.
  [[nodiscard]] double smooth_cadence_rad_s() const noexcept { return cadence_rad_s_; }
  // What a warm-up needs to know of the legs at this frame.
  [[nodiscard]] LegMotion legs() const noexcept {
    return {strides(), stride_.cadence_rad_s(), stride_.angle_rad(), leg_rad_};
  }
  // The next frame is the first of a clip, whose beginning it has seen backwards; open if it has
  // seen nothing.
  void settle() noexcept;

 private:
  void see_pose(const TrainedMotion& known, const Distance& distance, bool is_own) noexcept;
  void see_legs(const TrainedMotion& known, const Frame& frame, const std::optional<Walker>& walker,
                double dt_s) noexcept;
  // Of what the gate follows: all but rest, and what tells rest; NaN: not known.
  struct Evidence {
    double knows = 0.0;
    double swing_rad = std::numeric_limits<double>::quiet_NaN();
    double speed_deg_s = std::numeric_limits<double>::quiet_NaN();
  };
  [[nodiscard]] double pace_rad_s(const TrainedMotion& known) const noexcept;
  [[nodiscard]] static double of_rest(const TrainedMotion& known, const Evidence& seen) noexcept;
  [[nodiscard]] double of_run(const TrainedMotion& known, double cadence) const noexcept;
  void follow(const TrainedMotion* known, const Evidence& from, double dt_s) noexcept;

  bool fresh_ = true;  // was never on
  LiveStride stride_;
  LiveGait gait_;
  PoseSpeed speed_;
  double cadence_rad_s_ = 0.0;  // smoothed; 0: not known
  double steady_rad_s_ = 0.0;   // smoothed over a step
  double rest_rad_ = 0.0;       // the stride's angle when the legs last rested
  double leg_rad_ = std::numeric_limits<double>::quiet_NaN();  // the leg signal; NaN: not measured
  // The last evidence; it stays where a frame has none.
  double of_pose_ = 0.0, of_near_pose_ = 0.0, of_cadence_ = 1.0, of_legs_ = 1.0;
  Evidence seen_;
  Fade fade_;  // follows seen_
};

class WalkerTracker {
 public:
  // The notices, in the order of style_type().
  enum Notice : std::size_t { kNoGateData, kWarmedUp, kStood, kInterrupted, kOtherJoints, kNoAxis };

  // Advances by a frame's q, `gap_s` after the last one, of which `dt_s` count, and writes what the
  // kernel shall see of it: q as if the walker's neutral walk were the training's, and where a part
  // of the body does something else, what it does in a walk at this instant. Returns whether that
  // has changed suddenly.
  bool see(const BoundModel& model, const Frame& frame, std::span<const float> q,
           std::span<const std::uint8_t> available, double gap_s, double dt_s,
           std::span<float> input) noexcept;

  void set_gate(bool on) noexcept { gate_on_ = on; }
  void set_auto_alpha(bool on) noexcept { auto_alpha_ = on; }
  [[nodiscard]] float open() const noexcept { return gate_.open(); }
  // How far each part of the body walks: 1 all, 0 it does something else.
  [[nodiscard]] float trust(LoosePart part) const noexcept {
    return part == LoosePart::kNone ? 1.0F : trust_[index_of(part)];
  }
  // Whether `input` of see() is a pose of training that stands for the walker's.
  [[nodiscard]] bool shifts() const noexcept { return shifts_; }
  // Of the walker now; a usual one where that is not known.
  [[nodiscard]] double cadence_rad_s(const BoundModel& model) const noexcept;
  // See Gate::settle().
  void settle() noexcept { gate_.settle(); }

  // 0: none of it, 1: all of it; NaN: unknown.
  [[nodiscard]] double estimate() const noexcept { return estimate_.value(); }

  // Starts a warm-up of so many seconds, in the place of one that runs. False for a model that has
  // no data for it.
  [[nodiscard]] bool warm_up(const BoundModel* model, double seconds) noexcept;
  // The walker is known from elsewhere, in the model's pose space. False as above.
  [[nodiscard]] bool know(const BoundModel* model, const Walker& walker) noexcept;
  // Nothing more comes to measure on.
  void interrupt() noexcept;
  // In the place of a warm-up; empty: none.
  void set_walker(const std::optional<Walker>& walker) noexcept {
    walker_ = walker;
    adapted_ = false;
  }
  [[nodiscard]] const std::optional<Walker>& walker() const noexcept { return walker_; }

  // There is no model any more, in whose terms the walker was known.
  void forget() noexcept;
  // The model is exchanged. What is known of the walker is kept where both see the same joints.
  void exchange(const BoundModel* from, const BoundModel& to) noexcept;

  void report(Notice notice) noexcept { pending_ |= 1U << notice; }
  [[nodiscard]] std::optional<StageNotice> take_notice() noexcept;

 private:
  [[nodiscard]] bool serves(const BoundModel* model) noexcept;
  void report_missing_data(const BoundModel& model) noexcept;
  void adapt(const BoundModel& model) noexcept;
  void relate(const BoundModel& model, std::span<const float> q,
              std::span<const std::uint8_t> available, double dt_s,
              std::span<float> input) noexcept;
  void follow_trust(const BoundModel& model, std::span<const std::uint8_t> available, double dt_s,
                    std::span<const float> input) noexcept;
  void replace_untrusted(const BoundModel& model, std::span<const std::uint8_t> available,
                         std::span<float> input) noexcept;
  bool measure(const BoundModel& model, std::span<const float> q,
               std::span<const std::uint8_t> available, double gap_s, double dt_s) noexcept;

  bool gate_on_ = true, auto_alpha_ = false;
  Gate gate_;
  WarmUp warm_up_;
  std::optional<Walker> walker_;
  // Of the walker and the model, once they are adapted to each other.
  bool adapted_ = false;
  bool shifts_ = false;                       // by the walker's cycle; else by its mean
  LegMap shift_;                              // from the walker's neutral walk to the model's
  const BoundModel::Usual* usual_ = nullptr;  // the neutral walk that is nearest to the walker's
  bool replaced_ = false;                     // something of the last frame
  double whole_deg_ = 0.0;                    // how far the last one was from training before
  // What the poses say of each part, which changes within a few frames, and what follows it.
  using Trust = std::array<float, kLooseParts>;
  static constexpr Trust kAllTrust = {1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F};
  Trust seen_trust_ = kAllTrust, trust_ = kAllTrust;
  std::array<Fade, kLooseParts> fades_{};
  bool trusts_ = false;  // something was seen
  StyleEstimate estimate_;
  std::uint32_t pending_ = 0;
  bool reported_no_gate_ = false, reported_no_axis_ = false;
};

}  // namespace posed::style
