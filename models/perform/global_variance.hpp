// Global variance (models/perform/README.md, "Global variance"): the most likely trajectory stays
// nearer to its mean than the gestures it was learnt from; this gives the range back. Cold.
#pragma once

#include "models/perform/perform.hpp"

namespace posed::perform {

inline constexpr double kMaxVarianceGain = 1.3;

// Scales each channel about its mean over the string, by 1 to kMaxVarianceGain, towards the
// variance over time that the means of the performed states have.
void restore_variance(const gesture::GestureModel& model, Performance& performance);

}  // namespace posed::perform
