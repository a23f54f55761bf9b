#include "drivers/rate_text.hpp"

#include <charconv>

namespace posed::drivers {

std::optional<double> parse_rate(std::string_view text, std::string_view prefix, double most_hz) {
  if (!text.starts_with(prefix)) return std::nullopt;
  double rate_hz = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + prefix.size(), end, rate_hz);
  const bool sound = error == std::errc() && stop == end && rate_hz > 0.0 && rate_hz <= most_hz;
  return sound ? std::optional(rate_hz) : std::nullopt;
}

}  // namespace posed::drivers
