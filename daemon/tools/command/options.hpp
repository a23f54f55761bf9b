// What options of several commands share: checks of numbers, the word of --hand, and degrees. Cold.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "proto/clip/figure.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand.hpp"
#include "proto/text/number.hpp"

// Checks of options that take a number. CLI11's own ones compare only, so `nan` passes them and a
// command computes with it.

namespace posed::tools {

namespace detail {

// The number that all of the text is, or NaN.
inline double number_of(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  return exact_number<double>(text).value_or(std::nan(""));
}

// `takes` says which numbers, `help` is what --help shows.
template <typename Allowed>
CLI::Validator number_check(std::string takes, std::string help, Allowed allowed) {
  return {[takes = std::move(takes), allowed](const std::string& text) {
            const double value = number_of(text);
            return std::isfinite(value) && allowed(value)
                       ? std::string()
                       : fmt::format("'{}' should be a number {}", text, takes);
          },
          std::move(help)};
}

}  // namespace detail

inline CLI::Validator in_range(double least, double most) {
  return detail::number_check(
      fmt::format("from {:g} to {:g}", least, most),
      fmt::format("FLOAT in [{:g} - {:g}]", least, most),
      [least, most](double value) { return least <= value && value <= most; });
}

inline CLI::Validator above_zero() {
  return detail::number_check("above 0", "POSITIVE", [](double value) { return value > 0.0; });
}

// A seed: digits alone, because the library would take -1 for 2^64 - 1.
inline CLI::Validator whole_number() {
  return {[](const std::string& text) {
            return exact_number<std::uint64_t>(text)
                       ? std::string()
                       : fmt::format("'{}' should be a whole number of 0 or more", text);
          },
          "NONNEGATIVE"};
}

// The program computes in radians; the user interface shows degrees.
inline constexpr double kDegrees = 1.0 / kDegree;  // degrees in a radian

// The side that --hand names. `word` is "left" or "right"; CLI11 has refused all others.
[[nodiscard]] constexpr Side side_named(std::string_view word) noexcept {
  return word == "left" ? Side::kLeft : Side::kRight;
}

// The options that say what a clip's figure is: --profile, --up, --facing and --unit.
inline void add_figure_options(CLI::App& command, clip::ReadOptions& read) {
  command.add_option("--profile", read.profile,
                     "Skeleton profile: a name, or a file that `posed inspect --write` made "
                     "(default: recognised)");
  command
      .add_option_function<std::string>(
          "--up", [&read](const std::string& text) { read.up = up_from_text(text); },
          "The axis of a clip that points up (default: recognised)")
      ->check(CLI::IsMember({"+y", "+z", "-y", "-z", "+x"}));
  command
      .add_option_function<std::string>(
          "--facing", [&read](const std::string& text) { read.facing = axis_from_text(text); },
          "The axis that the zero pose of a clip faces (default: recognised by left and right)")
      ->check(CLI::IsMember({"+x", "-x", "+y", "-y", "+z", "-z"}));
  command
      .add_option_function<std::string>(
          "--unit",
          [&read](const std::string& text) { read.metres_per_unit = clip::metres_of_unit(text); },
          "Unit of a clip: m, dm, cm, mm, inch, foot or a number of metres (default: the file's, "
          "or recognised)")
      ->check([](const std::string& text) {
        return clip::metres_of_unit(text) ? std::string()
                                          : fmt::format("'{}' is no unit of length", text);
      });
}

}  // namespace posed::tools
