// Gate: fades the style out where the model does not know the motion, and in again where it does
// (README.md, "Gate"). State of one stream. RT-safe.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "models/style/live/live_motion.hpp"
#include "models/style/live/trained_motion.hpp"
#include "models/style/live/warm_up.hpp"
#include "proto/frame/frame.hpp"

namespace posed::style {

class Gate {
 public:
  // Advances by a frame, `dt_s` after the last one. `q` is the pose that the kernel sees, `whole`
  // the same with what busy limbs do; `walker`: seen from its own neutral walk. Where the gate is
  // not `on`, or the model has no data for it
  // (`known` is null), it opens: at once if it has never been on.
  void update(const TrainedMotion* known, bool on, const Frame& frame, std::span<const float> q,
              std::span<const float> whole, std::span<const std::uint8_t> available,
              const std::optional<Walker>& walker, double dt_s) noexcept;

  // How much style passes: 1 all, exactly, to 0 none, exactly; 0 before the first frame. It takes
  // about 0.17 s half of the way, and its third derivative is finite.
  [[nodiscard]] float open() const noexcept { return static_cast<float>(stage_.back()); }
  // Whether the legs stride as in training; true where that is unknown.
  [[nodiscard]] bool strides() const noexcept { return of_legs_ >= 0.5; }
  // Of the stride, without what a single frame adds; 0: not known.
  [[nodiscard]] double smooth_cadence_rad_s() const noexcept { return cadence_rad_s_; }
  // What a warm-up needs to know of the legs at this frame.
  [[nodiscard]] LegMotion legs() const noexcept {
    return {strides(), stride_.cadence_rad_s(), stride_.angle_rad(), leg_rad_};
  }
  // The next frame is the first of a clip, whose beginning it has seen backwards; open if it has
  // seen nothing.
  void settle() noexcept;

 private:
  void see_pose(const TrainedMotion& known, std::span<const float> q, std::span<const float> whole,
                std::span<const std::uint8_t> available, bool is_own, double dt_s) noexcept;
  void see_legs(const TrainedMotion& known, const Frame& frame, const std::optional<Walker>& walker,
                double dt_s) noexcept;
  // Of what the gate follows: all but rest, and what tells rest; NaN: not known.
  struct Evidence {
    double knows = 0.0;
    double swing_rad = std::numeric_limits<double>::quiet_NaN();
    double speed_deg_s = std::numeric_limits<double>::quiet_NaN();
  };
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
  std::array<double, 4> stage_{};  // low-passes in a row, the first follows seen_
};

}  // namespace posed::style
