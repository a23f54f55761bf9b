#include "drivers/source_type.hpp"

#include <charconv>

#include "proto/clip/text.hpp"

namespace posed::drivers {

OptionSpec rate_option(double default_hz, std::string_view help) {
  return {.name = "rate_hz",
          .default_value = default_hz,
          .help = help,
          .min = kMinRate_hz,
          .max = kMaxRate_hz};
}

std::string rate_text(std::string_view prefix, double rate_hz) {
  return std::string(prefix) + clip::number_text(rate_hz);
}

std::optional<double> parse_rate(std::string_view text, std::string_view prefix) {
  if (!text.starts_with(prefix)) return std::nullopt;
  double rate_hz = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + prefix.size(), end, rate_hz);
  const bool valid = error == std::errc() && stop == end && rate_hz > 0.0 && rate_hz <= kMaxRate_hz;
  return valid ? std::optional(rate_hz) : std::nullopt;
}

std::unexpected<Error> another_device(std::string_view what, const std::string& example,
                                      const std::string& identity) {
  return fail(
      "is not described as " + std::string(what) + " ('" + example + "'); is it another device?",
      identity);
}

}  // namespace posed::drivers
