// Numbers by name, as people write them in one text: "feminine=0.6,elderly=0.4". Cold.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed {

struct NamedNumber {
  std::string name;
  double number = 0.0;
};

// In the order of the text; blanks around names and numbers do not count, empty text has none.
// `what` names the text in the error: "weights". Numbers are from `low` to `high`, which are
// whole, and no name comes twice.
Result<std::vector<NamedNumber>> parse_named_numbers(std::string_view text, std::string_view what,
                                                     double low, double high);

}  // namespace posed
