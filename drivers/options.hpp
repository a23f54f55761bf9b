// Reads a driver's options (the values from the config, completed and checked against the driver's
// list) and makes the device that a log rebuilds. Cold.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/driver.hpp"

namespace posed::drivers {

// Returns `given` completed with the driver's defaults; a whole number is accepted for a real one,
// and a real one without a fraction for a whole one.
// An unknown option, another type, a value that the list does not allow and a missing required
// option fail with misuse().
Result<Options> complete_options(const Driver& driver, const Options& given);

// Reads a completed option. A name or type that is not in the driver's list is a bug in the driver,
// and throws.
template <typename T>
[[nodiscard]] const T& option(const Options& options, const std::string& name) {
  return std::get<T>(options.at(name));
}

// Returns the words of a completed option that is a list, separated by blanks or commas.
[[nodiscard]] std::vector<std::string> words_option(const Options& options,
                                                    const std::string& name);

// Returns the index in `words` (OptionSpec::words) of the option's value, which is one of them.
[[nodiscard]] std::size_t choice_option(const Options& options, const std::string& name,
                                        std::span<const std::string_view> words);

// Makes description and decoder from `text` (Description::text) with the driver's own describe()
// and make_decoder(), so that a live stream uses exactly what a log rebuilds.
// Driver::open() adds the transport, warnings and how it is polled and opened again.
Result<Device> make_device(const Driver& driver, const std::string& text,
                           const std::string& identity);

}  // namespace posed::drivers
