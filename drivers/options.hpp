// Reads a driver's options: the values from the config, completed and checked against the driver's
// list.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"

namespace posed::drivers {

// Returns `given` completed with the driver's defaults; a whole number is accepted for a real one.
// An unknown option, another type or a missing required option is misuse. Cold.
[[nodiscard]] Result<Options> complete_options(const Driver& driver, const Options& given);

// Reads a completed option. A name or type that is not in the driver's list is a bug in the driver.
template <typename T>
[[nodiscard]] const T& option(const Options& options, const std::string& name) {
  return std::get<T>(options.at(name));
}

// A completed option that is a list of words, separated by blanks or commas.
[[nodiscard]] std::vector<std::string> words_option(const Options& options,
                                                    const std::string& name);

}  // namespace posed::drivers
