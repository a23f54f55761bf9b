// Guesses the unit of length, which a BVH does not state.
#pragma once

#include <string>
#include <vector>

#include "proto/frame/skeleton.hpp"

namespace posed::clip {

inline constexpr double kCmuUnit_m = 0.0254 / 0.45;  // an Acclaim file's `length 0.45`: inch / 0.45

// Metres per unit that bring the figure's standing height nearest to 1.7 m; the choices are metre,
// centimetre, and inch / 0.45. Adds a warning that the unit is a guess. Offsets of `skeleton` are
// in file units. The height is the sum of bone lengths from the lowest to the highest leaf, so it
// does not depend on the pose in which the OFFSETs were written.
[[nodiscard]] double guess_unit(const Skeleton& skeleton, std::vector<std::string>& warnings);

// True when the figure is between 0.8 and 2.6 m high in this unit.
[[nodiscard]] bool is_a_person(const Skeleton& skeleton, double metres_per_unit);

// Multiplies offsets and end sites by `metres_per_unit`.
void scale_lengths(Skeleton& skeleton, double metres_per_unit);

}  // namespace posed::clip
