// The screen of `posed calibrate` as lines of text: which pose is wanted, what to do now, and a bar
// for each sensor. Pure, so that it can be looked at without a terminal.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "drivers/glove/fit.hpp"
#include "drivers/glove/model.hpp"

namespace posed::cli {

struct SensorView {
  std::string name;
  double least = 0.0, most = 255.0;  // what the device can send
  double least_span = 10.0;          // below it there is only noise
  bool there = false;                // it has been measured
  double value = 0.0;                // now
  double low = 0.0, high = 0.0;      // where it has been since the first pose was held

  // Not at all yet, or not enough to be fitted.
  [[nodiscard]] bool still() const { return high - low < least_span; }
};

enum class PosePhase { kAsked, kSettling, kHeld };

struct CalibrateView {
  std::string title;
  std::vector<drivers::glove::Pose> poses;  // in their order
  std::size_t pose = 0;                     // which of them is wanted
  PosePhase phase = PosePhase::kAsked;
  double left_s = 0.0;    // of a phase that ends by itself; 0: the user ends it
  double share = 0.0;     // of such a phase that is over
  bool silent = false;    // nothing came for a while
  bool any_held = false;  // a pose was recorded: who has not moved is known from then on
  std::string note{};     // about the pose before; may be empty
  std::vector<SensorView> sensors{};
  int width = 80, height = 24;  // the terminal's; at least 40 columns are used
  bool colour = false;
};

// At most `height` lines of at most `width` columns. Sensors stand in as many columns as it takes;
// those that were never measured are left out.
[[nodiscard]] std::vector<std::string> calibrate_view(const CalibrateView& view);

// "#" up to the value, "-" where the sensor has been beside it, blanks else: `width` characters.
[[nodiscard]] std::string sensor_bar(const SensorView& sensor, int width);

}  // namespace posed::cli
