#include "drivers/options.hpp"

#include <algorithm>
#include <cassert>
#include <sstream>
#include <utility>

#include "drivers/glove/calibrated_decoder.hpp"

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

std::size_t choice_option(const Options& options, const std::string& name,
                          std::span<const std::string_view> words) {
  const auto at = std::ranges::find(words, std::string_view(option<std::string>(options, name)));
  assert(at != words.end());
  return at - words.begin();
}

Result<Device> make_device(const Driver& driver, const std::string& text,
                           const std::string& identity) {
  auto description = TRY(driver.describe(text, identity));
  auto decoder = TRY(driver.make_decoder(description));
  glove::CalibratedDecoder* const calibrated = glove::calibrated_decoder(*decoder);
  return Device{.description = std::move(description),
                .transport = nullptr,
                .decoder = std::move(decoder),
                .warnings = {},
                .calibrated = calibrated};
}

}  // namespace posed::drivers
