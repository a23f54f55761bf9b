// What a pose can be. A value beyond these limits is a mistake of a file or a device: it is counted
// as out of range and never published. The limits are far outside everything that was ever
// recorded, so that they refuse no real pose.
#pragma once

#include <numbers>

namespace posed {

inline constexpr double kTurn_rad = 2.0 * std::numbers::pi;

// Of a position from the world's origin, and of a bone's length. The largest capture halls have
// some 100 m; a clip whose unit of length was taken wrongly is off by 100 or 1000.
inline constexpr double kMaxPosition_m = 1000.0;

// Of a clip's joint angle. Recordings unwrap their angles: a dancer who spins goes on counting.
inline constexpr double kMaxAngle_rad = 100.0 * kTurn_rad;

// Of a hand's joint angle. No finger turns once; twice leaves room for a calibration that is bent.
inline constexpr double kMaxHandAngle_rad = 2.0 * kTurn_rad;

}  // namespace posed
