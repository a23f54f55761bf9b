// Takes of hands before a camera, for models that name the gestures of such hands: g, c, p, 1, 3
// and 4, performed by 32 drawn hands of different shape, size, colour, light and view, as
// MediaPipe (lite) and the landmarks driver see them, at ten pictures a second. Their angles are
// often wrong, and wrong in their own way: what a glove taught does not name them. Nobody was
// photographed (viewer/test/support/drawn_hands.cpp). Cold.
#pragma once

#include <vector>

#include "models/gesture/synthetic_signer.hpp"

namespace posed::gesture {

inline constexpr double kCameraRate_hz = 10.0;

[[nodiscard]] std::vector<Performance> camera_takes();

}  // namespace posed::gesture
