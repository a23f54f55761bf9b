#include "drivers/options.hpp"

#include <algorithm>
#include <array>
#include <sstream>

namespace posed::drivers {
namespace {

constexpr std::array<std::string_view, 4> kTypeNames{"true or false", "a whole number", "a number",
                                                     "a text"};

std::string place(const Driver& driver, std::string_view name) {
  return "option '" + std::string(name) + "' of driver '" + std::string(driver.name) + "'";
}

}  // namespace

Result<Options> complete_options(const Driver& driver, const Options& given) {
  for (const auto& [name, value] : given) {
    if (std::ranges::find(driver.options, std::string_view(name), &OptionSpec::name) ==
        driver.options.end()) {
      return misuse("driver '" + std::string(driver.name) + "' has no option '" + name + "'");
    }
  }
  Options complete;
  for (const OptionSpec& spec : driver.options) {
    const std::string name(spec.name);
    const auto at = given.find(name);
    if (at == given.end() && spec.required) return misuse(place(driver, name) + " is missing");
    OptionValue value = at == given.end() ? spec.default_value : at->second;
    if (std::holds_alternative<double>(spec.default_value)) {
      if (const auto* whole = std::get_if<std::int64_t>(&value)) {
        value = static_cast<double>(*whole);
      }
    }
    if (value.index() != spec.default_value.index()) {
      return misuse(place(driver, name) + " should be " +
                    std::string(kTypeNames[spec.default_value.index()]));
    }
    complete.emplace(name, std::move(value));
  }
  return complete;
}

std::vector<std::string> words_option(const Options& options, const std::string& name) {
  std::string text = option<std::string>(options, name);
  std::ranges::replace(text, ',', ' ');
  std::istringstream words(text);
  std::vector<std::string> found;
  for (std::string word; words >> word;) found.push_back(word);
  return found;
}

}  // namespace posed::drivers
