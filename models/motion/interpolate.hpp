// A pose between two frames of one stream.
#pragma once

#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::motion {

// Replaces pose and validity of `out` by the pose at `share` (0 to 1) of the way from `a` to `b`:
// the root on a straight line, every joint by the shortest rotation (slerp). A joint is valid where
// both measured it; measured by only one, it has that one's rotation. The rest of `out` is kept,
// but its angles follow the rotations. All three are frames of `skeleton`.
RT_SAFE void interpolate(const Skeleton& skeleton, const Frame& a, const Frame& b, double share,
                         Frame& out) noexcept;

}  // namespace posed::motion
