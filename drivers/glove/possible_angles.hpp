// What hands can do, so that a calibration does not show what they cannot. Cold.
#pragma once

#include <string>
#include <vector>

#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::glove {

// "index MCP", "little MCP spread", "thumb CMC twist": a channel of HandAngles for people.
[[nodiscard]] std::string joint_words(std::size_t channel);

// Where a joint would be bent, in one of the poses, as no hand's is, the curve of its sensor ends
// at what hands can do. Returns a sentence for each such joint, of its worst pose. A joint that
// several sensors bend stays as it is, which its sentence says.
Result<std::vector<std::string>> keep_possible(const Model& model, const Recorded& recorded,
                                               Side hand, CalibrationFile& file);

}  // namespace posed::drivers::glove
