#include "drivers/options.hpp"

#include <algorithm>
#include <sstream>
#include <utility>

namespace posed::drivers {

Result<Options> complete_options(const Driver& driver, const Options& given) {
  auto complete = complete_parameters(driver.options, given);
  if (complete) return complete;
  Error error = complete.error();
  error.message = "driver '" + std::string(driver.name) + "': " + error.message;
  return std::unexpected(std::move(error));
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
