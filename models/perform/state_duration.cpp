#include "models/perform/state_duration.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace posed::perform {

using gesture::kStates;

RT_SAFE int state_frames(double mean, double variance, double rho, double carried) noexcept {
  constexpr double kMaxDuration = 1e6;  // frames; a damaged model must not overflow an int
  const double frames = std::floor(mean + rho * variance + carried + 0.5);
  return static_cast<int>(std::clamp(frames, 1.0, kMaxDuration));
}

RT_SAFE double tempo_rho(const gesture::DurationGaussian& duration, double tempo) noexcept {
  if (tempo == 1.0) return 0.0;
  double wanted = 0.0;
  for (int s = 0; s < kStates; ++s) wanted += state_frames(duration.mean[s], 0.0, 0.0, 0.0);
  wanted /= tempo;
  // States that the common rho would press below one frame are set to one and left out of the sum;
  // each round sets at least one of them or is the last.
  std::array<bool, kStates> shortest{};
  double rho = 0.0;
  for (int round = 0; round < kStates; ++round) {
    double left = wanted;
    double variance = 0.0;
    for (int s = 0; s < kStates; ++s) {
      left -= shortest[s] ? 1.0 : duration.mean[s];
      variance += shortest[s] ? 0.0 : duration.variance[s];
    }
    if (!(variance > 0.0)) return rho;
    rho = left / variance;
    bool settled = true;
    for (int s = 0; s < kStates; ++s) {
      const bool below = duration.mean[s] + rho * duration.variance[s] < 1.0;
      if (below && !shortest[s]) shortest[s] = true, settled = false;
    }
    if (settled) break;
  }
  return rho;
}

}  // namespace posed::perform
