#include "daemon/tools/devices/driver_options.hpp"

#include <algorithm>
#include <charconv>

#include <spdlog/fmt/fmt.h>

#include "drivers/options.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

template <typename Number>
bool parse(const std::string& text, Number& number) {
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && stop == end;
}

// Converts the text to the type of the option's default; returns false if it does not fit.
bool read_value(const std::string& text, drivers::OptionValue& value) {
  if (auto* flag = std::get_if<bool>(&value)) {
    *flag = text == "true";
    return text == "true" || text == "false";
  }
  if (auto* whole = std::get_if<std::int64_t>(&value)) return parse(text, *whole);
  if (auto* number = std::get_if<double>(&value)) return parse(text, *number);
  value = text;
  return true;
}

}  // namespace

Result<drivers::Options> parse_driver_options(const drivers::Driver& driver,
                                              const std::vector<std::string>& words) {
  drivers::Options options;
  for (const std::string& word : words) {
    const auto equals = word.find('=');
    const std::string key = word.substr(0, equals);
    const auto spec =
        std::ranges::find(driver.options, std::string_view(key), &drivers::OptionSpec::name);
    if (spec == driver.options.end() || equals == std::string::npos) {
      const std::string known = joined(driver.options, ", ", &drivers::OptionSpec::name);
      return misuse(fmt::format("'{}' is not an option of {}; KEY=VALUE with one of: {}", word,
                                driver.name, known));
    }
    drivers::OptionValue value = spec->default_value;
    if (!read_value(word.substr(equals + 1), value)) {
      return misuse("'" + word + "': " + std::string(spec->help));
    }
    options[key] = std::move(value);
  }
  return drivers::complete_options(driver, options);
}

}  // namespace posed::tools
