// Reading a driver's options: what the config gave, completed and checked against the driver's
// list.
#pragma once

#include <string>
#include <string_view>

#include "drivers/driver.hpp"

namespace posed::drivers {

// `given` with the driver's defaults for what is left out; a whole number serves where a real one
// is wanted. An unknown option, another type or a missing required one is misuse. Cold.
[[nodiscard]] Result<Options> complete_options(const Driver& driver, const Options& given);

// Of completed options; asking for another name or type than the driver's list has is our own bug.
template <typename T>
[[nodiscard]] const T& option(const Options& options, const std::string& name) {
  return std::get<T>(options.at(name));
}

}  // namespace posed::drivers
