#include "drivers/source_type.hpp"

#include "proto/clip/text.hpp"
#include "proto/text/number.hpp"

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
  const auto rate_hz = exact_number<double>(text.substr(prefix.size()));
  return rate_hz && *rate_hz > 0.0 && *rate_hz <= kMaxRate_hz ? rate_hz : std::nullopt;
}

std::unexpected<Error> another_device(std::string_view what, const std::string& example,
                                      const std::string& identity) {
  return fail(
      "is not described as " + std::string(what) + " ('" + example + "'); is it another device?",
      identity);
}

}  // namespace posed::drivers
