#include "proto/text/parameter.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "proto/text/clean.hpp"
#include "proto/text/list.hpp"

namespace posed {
namespace {

constexpr std::array<std::string_view, 4> kWanted{"true or false", "an integer", "a number",
                                                  "text in quotes"};
constexpr std::array<std::string_view, 4> kGiven{"true or false", "an integer", "a number", "text"};

std::string text_of(double number) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}

double display_bound(const ParameterSpec& spec, double bound) {
  const double scaled = bound * spec.display_scale;
  // A bound such as 90 degrees stays a round number on its way to radians and back.
  const double rounded = std::round(scaled * 1e9) / 1e9;
  return std::isfinite(rounded) ? rounded : bound;
}

// Whether an integer holds the number exactly.
bool is_whole(double number) {
  constexpr double kExact = 9007199254740992.0;                       // 2^53
  return std::abs(number) <= kExact && std::trunc(number) == number;  // false for NaN
}

bool within(const ParameterSpec& spec, double value) {
  return value >= spec.min && value <= spec.max;  // false for NaN
}

Result<ParameterValue> one_of_words(const ParameterSpec& spec, const std::string& word,
                                    std::string_view place) {
  if (std::ranges::find(spec.words, std::string_view(word)) != spec.words.end()) return word;
  return misuse(std::string(place) + " must be " + alternatives(spec.words) + ", not " +
                in_quotes(word));
}

}  // namespace

const ParameterSpec* find_parameter(std::span<const ParameterSpec> table, std::string_view name) {
  const auto found = std::ranges::find_if(table, [&](const ParameterSpec& spec) {
    return spec.name == name || spec.display_name == name;
  });
  return name.empty() || found == table.end() ? nullptr : &*found;
}

Result<ParameterValue> from_display(const ParameterSpec& spec, const ParameterValue& value,
                                    std::string_view place) {
  const bool real = std::holds_alternative<double>(spec.default_value);
  if (const auto* number = std::get_if<double>(&value);
      number != nullptr && is_whole(*number) &&
      std::holds_alternative<std::int64_t>(spec.default_value)) {
    return from_display(spec, static_cast<std::int64_t>(*number), place);
  }
  const auto* whole = std::get_if<std::int64_t>(&value);
  if (value.index() != spec.default_value.index() && !(real && whole != nullptr)) {
    return misuse(std::string(place) + " must be " +
                  std::string(kWanted[spec.default_value.index()]) +
                  (real ? unit_words(spec.shown_name()) : "") + ", not " +
                  std::string(kGiven[value.index()]));
  }
  if (real) {
    const double given = whole != nullptr ? static_cast<double>(*whole) : std::get<double>(value);
    const double ours = given / spec.display_scale;
    if (within(spec, ours)) return ours;
    return misuse(
        out_of_range(place, given, display_bound(spec, spec.min), display_bound(spec, spec.max)));
  }
  if (whole != nullptr && !within(spec, static_cast<double>(*whole))) {
    return misuse(out_of_range(place, static_cast<double>(*whole), spec.min, spec.max, true));
  }
  if (!spec.words.empty()) return one_of_words(spec, std::get<std::string>(value), place);
  return value;
}

Result<Parameters> complete_parameters(std::span<const ParameterSpec> table,
                                       const Parameters& given) {
  for (const auto& [name, value] : given) {
    if (std::ranges::find(table, std::string_view(name), &ParameterSpec::name) == table.end()) {
      return misuse("there is no " + name);
    }
  }
  Parameters complete;
  for (const ParameterSpec& spec : table) {
    const std::string name(spec.name);
    const auto at = given.find(name);
    if (at == given.end()) {
      if (spec.required) return misuse(name + " is missing");
      complete.emplace(name, spec.default_value);
      continue;
    }
    ParameterSpec ours = spec;
    ours.display_name = {};
    ours.display_scale = 1.0;
    auto value = TRY(from_display(ours, at->second, name));
    complete.emplace(name, std::move(value));
  }
  return complete;
}

bool has_number(const ParameterSpec& spec) noexcept {
  return !std::holds_alternative<std::string>(spec.default_value) || !spec.words.empty();
}

double number_of(const ParameterSpec& spec, const ParameterValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? 1.0 : 0.0;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return static_cast<double>(*whole);
  if (const auto* word = std::get_if<std::string>(&value)) {
    return static_cast<double>(std::ranges::find(spec.words, std::string_view(*word)) -
                               spec.words.begin());
  }
  return std::get<double>(value);
}

bool takes_number(const ParameterSpec& spec, double number) {
  if (std::holds_alternative<bool>(spec.default_value)) return number == 0.0 || number == 1.0;
  if (std::holds_alternative<std::string>(spec.default_value)) {
    return is_whole(number) && number >= 0.0 && number < static_cast<double>(spec.words.size());
  }
  const bool whole = std::holds_alternative<std::int64_t>(spec.default_value);
  return within(spec, number) && (!whole || is_whole(number));
}

std::string display_text(const ParameterSpec& spec, double number) {
  if (std::holds_alternative<bool>(spec.default_value)) return number != 0.0 ? "true" : "false";
  if (!spec.words.empty()) {
    return takes_number(spec, number) ? std::string(spec.words[static_cast<std::size_t>(number)])
                                      : std::string();
  }
  std::array<char, 32> text{};
  const double shown = number * spec.display_scale;
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), shown, std::chars_format::general, 6)
          .ptr;
  return {text.data(), end};
}

std::string unit_words(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, const char*>, 9> kUnits{{
      {"_per_s", " per second"},
      {"_ms", " of milliseconds"},
      {"_s", " of seconds"},
      {"_hz", " of hertz"},
      {"_deg", " of degrees"},
      {"_rad", " of radians"},
      {"_cm", " of centimetres"},
      {"_m", " of metres"},
      {"_frames", " of frames"},
  }};
  for (const auto& [suffix, words] : kUnits) {
    if (name.ends_with(suffix)) return words;
  }
  return {};
}

std::string out_of_range(std::string_view place, double value, double min, double max, bool whole) {
  constexpr double kUnbounded = std::numeric_limits<double>::max();
  std::string wanted = " that is finite";
  if (min > -kUnbounded && max < kUnbounded) {
    wanted = " from " + text_of(min) + " to " + text_of(max);
  } else if (min > -kUnbounded) {
    wanted = " of at least " + text_of(min);
  } else if (max < kUnbounded) {
    wanted = " of at most " + text_of(max);
  }
  return std::string(place) + " = " + text_of(value) + " is out of range: it takes " +
         (whole ? "an integer" : "a number") + unit_words(place) + wanted;
}

}  // namespace posed
