// The hand that a new calibration makes of the poses that it was fitted to, drawn as text, so that
// its user sees at once whether the hand does what theirs did.
#pragma once

#include <string>
#include <vector>

#include "drivers/glove/calibration.hpp"
#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"
#include "proto/frame/hand.hpp"

namespace posed::tools {

// The recorded poses beside each other with their names below, at one scale: `rows` lines of UTF-8
// of at most `columns` characters. A joint that no sensor measures is straight.
[[nodiscard]] std::vector<std::string> calibrated_hand(
    const drivers::glove::Model& model, const drivers::glove::Calibration& calibration, Side hand,
    const drivers::glove::Recorded& recorded, int columns, int rows);

}  // namespace posed::tools
