// Tables of named, typed, range-checked values: the options of a driver, the parameters of a stage,
// the options of a stage's command. Config, control, device log and replay all read one table.
// Cold.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>

#include "proto/frame/result.hpp"

namespace posed {

using ParameterValue = std::variant<bool, std::int64_t, double, std::string>;
using Parameters = std::map<std::string, ParameterValue>;  // by ParameterSpec::name

struct ParameterSpec {
  std::string_view name;           // its unit last: "lag_s"
  ParameterValue default_value{};  // also fixes the type
  bool required = false;
  bool is_path = false;  // relative to the config file; the default is none
  std::string_view help;
  // The range of a number, both ends included.
  double min = std::numeric_limits<double>::lowest();
  double max = std::numeric_limits<double>::max();
  // Control can change it while the stream runs: numbers, flags, and texts with `words`.
  bool live = false;
  // People write some numbers in another unit: as `display_name` ("lag_ms"), with `display_scale`
  // of their units to one of ours (1000). Empty: the same name and unit.
  std::string_view display_name{};
  double display_scale = 1.0;
  // A text that is one of these. Where it is live, a number stands for it: its place here.
  std::span<const std::string_view> words{};
  // What a path ends in, where any other text is the name of what is built in; empty: all are
  // paths.
  std::string_view path_ending{};

  [[nodiscard]] std::string_view shown_name() const noexcept {
    return display_name.empty() ? name : display_name;
  }
};

// The entry of this name, as people write it or as the log does; null if there is none.
[[nodiscard]] const ParameterSpec* find_parameter(std::span<const ParameterSpec> table,
                                                  std::string_view name);

// Checks type and range of a value in people's units and returns it in ours; an integer is accepted
// for a real number, and a real number without a fraction for an integer. `place` names it in the
// error: "stream.style.alpha = 3 is out of range: it takes a number from -2 to 2".
Result<ParameterValue> from_display(const ParameterSpec& spec, const ParameterValue& value,
                                    std::string_view place);

// The values of `given`, which are in our units, checked, and the defaults of all others. A name
// that is not in the table, another type and a number out of range are errors.
Result<Parameters> complete_parameters(std::span<const ParameterSpec> table,
                                       const Parameters& given);

// The value of a complete table. Another name or type than the table's is a bug of the caller.
template <typename T>
[[nodiscard]] const T& parameter(const Parameters& parameters, const std::string& name) {
  return std::get<T>(parameters.at(name));
}

// Returns whether a number stands for the values of this parameter, as it does for all but texts
// without words.
[[nodiscard]] bool has_number(const ParameterSpec& spec) noexcept;
// A flag as 0 or 1, a number as it is, a word as its place among the parameter's words. Not for
// other text.
[[nodiscard]] double number_of(const ParameterSpec& spec, const ParameterValue& value);
// Returns whether a live parameter can have the value that this number, in our units, stands for.
[[nodiscard]] bool takes_number(const ParameterSpec& spec, double number);
// That value as the config writes it: "true", "1.5", "stride".
[[nodiscard]] std::string display_text(const ParameterSpec& spec, double number);

// " of milliseconds" for a name that ends in _ms, and so on; empty without a known unit.
[[nodiscard]] std::string unit_words(std::string_view name);
// "PLACE = 3 is out of range: it takes a number from -2 to 2".
[[nodiscard]] std::string out_of_range(std::string_view place, double value, double min, double max,
                                       bool whole = false);

}  // namespace posed
