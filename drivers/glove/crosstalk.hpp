// Fits what a glove's sensors show of each other's movement, from the fist among the poses and from
// two moves that the user may make after them. Cold.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// Raw values during one move, [sensor of the model]; NaN where not measured.
using Move = std::vector<std::array<float, kMaxSensors>>;

struct Moves {
  Move bend;    // fingers bend and stretch one after the other, then all: nothing spreads
  Move spread;  // straight fingers spread and close: nothing bends
};

// Adds shares to `file`, which fit_poses() has made: a fist spreads no finger, so what its sensors
// of spread show are the bends beside them. Only the shares' sum over all bends is known then; they
// count as equal. Returns a sentence for each sensor that shows more than 3 degrees.
Result<std::vector<std::string>> fit_fist(const Model& model, const Recorded& recorded, Side hand,
                                          CalibrationFile& file);

// Adds the shares to `file`, which fit_poses() has made: what sensors of spread show of bent
// fingers, and the other way round. A share is kept only where it was found in one half of the move
// and explains the other half, and replaces that of fit_fist(). Returns a sentence for each sensor
// that has one.
Result<std::vector<std::string>> fit_crosstalk(const Model& model, const Moves& moves, Side hand,
                                               CalibrationFile& file);

}  // namespace posed::drivers::glove
