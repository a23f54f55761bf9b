// The range of plausible pose values. A value beyond these limits is a mistake in a file or a
// device: it is counted as out of range and never published. The limits lie far outside every real
// recording, so they reject no real pose.
#pragma once

#include <numbers>

namespace posed {

inline constexpr double kTurn_rad = 2.0 * std::numbers::pi;

// Limit for a position from the world's origin, and for a bone's length. The largest capture halls
// have about 100 m; a clip read in the wrong unit of length is off by a factor of 100 or 1000.
inline constexpr double kMaxPosition_m = 1000.0;

// Limit for a joint angle of a clip. Recordings unwrap angles, so a spinning dancer's keeps
// growing.
inline constexpr double kMaxAngle_rad = 100.0 * kTurn_rad;

// Limit for a hand's joint angle. No finger turns even once; two turns leave room for a poor
// calibration.
inline constexpr double kMaxHandAngle_rad = 2.0 * kTurn_rad;

}  // namespace posed
