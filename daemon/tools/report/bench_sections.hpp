// The figures of a report on a measurement: distributions by their percentiles. Cold.
#pragma once

#include <string>
#include <vector>

#include "daemon/tools/report/page.hpp"

namespace posed::report {

struct Percentiles {
  double p50_us = 0.0, p99_us = 0.0, p999_us = 0.0, max_us = 0.0;
};

// One quantity of the program, and of what it is compared with.
struct Measured {
  std::string name;
  Percentiles percentiles;
};
struct PercentileBars {
  std::string title, sentence;
  std::string quantity;         // of the axis: "age at the subscriber"
  std::vector<Measured> peers;  // at most as many as there are colours
};
[[nodiscard]] Figure percentile_bars(const PercentileBars& bars);

// One percentile of many pairs: `name` has a value of each series.
struct PairedBars {
  std::string title, sentence, quantity, unit;
  std::vector<std::string> series;
  struct Row {
    std::string name;
    std::vector<double> values;  // one a series
  };
  std::vector<Row> rows;
  int digits = 1;
};
[[nodiscard]] Figure paired_bars(const PairedBars& bars);

// Numbers by their names, which end in the unit.
struct NamedNumber {
  std::string name, value;
};
[[nodiscard]] Figure all_numbers(const std::string& title, const std::string& sentence,
                                 const std::vector<NamedNumber>& numbers);

}  // namespace posed::report
