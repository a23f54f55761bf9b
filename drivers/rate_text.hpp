// The rate in a device info like "vmc rate=60", which says what the options said, because such a
// device tells nothing about itself.
#pragma once

#include <optional>
#include <string_view>

namespace posed::drivers {

inline constexpr double kMostRate_hz = 1000.0;

// The number after `prefix`, if it ends the text and is more than 0 and at most `most_hz`. Cold.
[[nodiscard]] std::optional<double> parse_rate(std::string_view text, std::string_view prefix,
                                               double most_hz = kMostRate_hz);

}  // namespace posed::drivers
