// Fits what a glove's sensors show of each other's movement, from two moves that the user makes
// after the poses. Cold.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// Raw values during one move, [sensor of the model]; NaN where not measured.
using Move = std::vector<std::array<float, kMaxSensors>>;

struct Moves {
  Move bend;    // fingers bend and stretch one after the other, then all: nothing spreads
  Move spread;  // straight fingers spread and close: nothing bends
};

// Adds the shares to `file`, which fit_poses() has made: what sensors of spread show of bent
// fingers, and the other way round. A share is kept only where it was found in one half of the move
// and explains the other half. Returns a sentence for each sensor that has one.
Result<std::vector<std::string>> fit_crosstalk(const Model& model, const Moves& moves, Side hand,
                                               CalibrationFile& file);

}  // namespace posed::drivers::glove
