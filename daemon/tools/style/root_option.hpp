// The option --root of the commands that style clips: what a feet stage behind the style does with
// the root. Without it there is no such stage, as in a config without its table.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "models/feet/root_motion.hpp"

namespace posed::tools {

// `options` outlives the command.
inline void add_root_option(CLI::App& command, std::optional<feet::RootOptions>& options) {
  const auto set = [&options](const std::string& word) {
    const feet::RootMode mode = *feet::root_mode(word);
    options.reset();
    if (mode != feet::RootMode::kOff) options = feet::RootOptions{.mode = mode};
  };
  command
      .add_option_function<std::string>(
          "--root", set,
          "Feet stand. stride: the root walks as far as the styled legs do; actor: it stays on the"
          " performer, and the legs reach for the ground; off (the default): feet slide")
      ->check(CLI::IsMember(
          std::vector<std::string>(feet::kRootModes.begin(), feet::kRootModes.end())));
}

// As the option has it.
[[nodiscard]] inline std::string root_text(const std::optional<feet::RootOptions>& options) {
  return std::string(feet::root_name(options ? options->mode : feet::RootMode::kOff));
}

}  // namespace posed::tools
