// Global variance (models/perform/README.md, "Global variance"): the most likely trajectory stays
// closer to its mean than the gestures it was learnt from; this restores the range. Cold.
#pragma once

#include "models/perform/perform.hpp"

namespace posed::perform {

inline constexpr double kMaxVarianceGain = 1.3;

// Scales each channel about its mean over the sequence, by 1 to kMaxVarianceGain, so that its
// variance over time approaches that of the means of the performed states.
void restore_variance(const gesture::GestureModel& model, Performance& performance);

}  // namespace posed::perform
