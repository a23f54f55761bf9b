// How well the feet of a clip stand (models/feet/README.md, "Figures"). Cold.
#pragma once

#include <array>
#include <optional>

#include "models/feet/legs.hpp"
#include "models/motion/motion.hpp"

namespace posed::feet {

// The speed of standing ankles and toes over the ground [m/s]: the mean speed that they have in
// `moved` in the frames in which `source`, this motion before it was changed, moves them slower
// than 0.1 m/s. Empty where nothing stands or the skeleton has no legs.
[[nodiscard]] std::optional<double> slide_m_s(const motion::Motion& source,
                                              const motion::Motion& moved);

// How far the lowest toe of `moved` is below that of `source` [m]; 0 if it is not. Empty for a
// skeleton without legs.
[[nodiscard]] std::optional<double> sink_m(const motion::Motion& source,
                                           const motion::Motion& moved);

// How far the lowest toe of a motion is below the height at which its toes stand: the median over
// the frames in which they are slower than 0.1 m/s [m]. Empty where none stands or the skeleton has
// no toes.
[[nodiscard]] std::optional<double> below_standing_m(const motion::Motion& motion);

// Speed of the root over the ground [m/s]: the median of how far it gets within `period_s`, a
// stride, over that time; so neither its sway nor a stand at either end counts. 0 for a clip that
// is shorter.
[[nodiscard]] double root_speed_m_s(const motion::Motion& motion, double period_s);

// How the feet of a walk were captured, whatever the style.
struct FootCapture {
  // Speed over the ground of the ankle that is slower, the median over the frames [m/s]: of a walk
  // one foot always stands.
  double slower_m_s = 0.0;
  // How far each ankle gets from its mean place, seen from the pelvis, as a standard deviation [m].
  std::array<double, kLegs> swing_m{};
  // How much the height of the lower ankle differs between parts of half a second: the lowest of
  // each part, from the lowest tenth to the highest [m].
  double uneven_m = 0.0;
};

// Empty for a skeleton without two legs that are measured, and for a motion shorter than 2 s.
[[nodiscard]] std::optional<FootCapture> foot_capture(const motion::Motion& motion);

}  // namespace posed::feet
