// Bars beside each other, in groups of which each has a name: horizontal, because names are long.
// Cold.
#pragma once

#include <string>
#include <vector>

#include "daemon/tools/report/page.hpp"

namespace posed::report {

struct BarGroup {
  std::string name;
  std::vector<double> values;  // one a series; not finite: there is none
};

struct BarRule {
  double value = 0.0;
  std::string words;
};

struct Bars {
  std::string quantity, unit;       // of the axis
  std::vector<std::string> series;  // their names, for the legend
  std::vector<BarGroup> groups;
  std::vector<BarRule> rules{};
  bool logarithmic = false;
  int digits = 1;  // of the numbers beside the bars
};

[[nodiscard]] Drawing draw_bars(const Bars& bars);

}  // namespace posed::report
