// How well the feet of a clip stand (README.md, "Figures"). Cold.
#pragma once

#include <optional>

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

}  // namespace posed::feet
