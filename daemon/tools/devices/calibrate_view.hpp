// The screen of `posed calibrate` as lines of text: which pose to take, what to do now, and a bar
// for each sensor. Pure, so that it can be tested without a terminal.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"

namespace posed::tools {

struct SensorView {
  std::string name;
  double least = 0.0, most = 255.0;  // the range that the device can send
  double least_span = 10.0;          // a smaller range is only noise
  bool there = false;                // has been measured
  double value = 0.0;                // the current value
  double low = 0.0, high = 0.0;      // the range seen since the first pose was held

  // Has not moved, or not enough to be fitted.
  [[nodiscard]] bool still() const { return high - low < least_span; }
};

enum class PosePhase { kAsked, kSettling, kHeld };

struct CalibrateView {
  std::string title;
  std::vector<drivers::glove::Pose> poses;  // in their order
  std::size_t pose = 0;                     // index of the current one
  PosePhase phase = PosePhase::kAsked;
  double left_s = 0.0;  // remaining time of a phase that ends by itself; 0: the user ends it
  double share = 0.0;   // elapsed share of such a phase
  bool silent = false;  // nothing came for a while
  // a pose was recorded; from then on it is known which sensors have not moved
  bool any_held = false;
  std::string note{};  // about the previous pose; may be empty
  std::vector<SensorView> sensors{};
  int width = 80, height = 24;  // of the terminal; at least 40 columns are used
  bool colour = false;
};

// At most `height` lines of at most `width` columns. Sensors are shown in as many columns as
// necessary; those that were never measured are left out.
[[nodiscard]] std::vector<std::string> calibrate_view(const CalibrateView& view);

// "#" up to the value, "-" elsewhere in the range seen so far, blanks outside it: `width`
// characters.
[[nodiscard]] std::string sensor_bar(const SensorView& sensor, int width);

}  // namespace posed::tools
