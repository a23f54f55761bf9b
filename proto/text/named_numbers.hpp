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

// Returns the numbers in the order of the text, none for empty text; blanks around names and
// numbers do not count. Errors: a number outside of `low` to `high` (which are whole), a name
// twice, more than 2,048 bytes. `what` names the text in them: "weights".
Result<std::vector<NamedNumber>> parse_named_numbers(std::string_view text, std::string_view what,
                                                     double low, double high);

}  // namespace posed
