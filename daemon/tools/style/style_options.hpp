// What the commands share that style clips: the option --root, and how a mixture is reported. Cold.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "daemon/tools/command/findings.hpp"
#include "models/feet/root_motion.hpp"
#include "models/style/live/style_weights.hpp"

namespace posed::tools {

// Adds --root: what a feet stage behind the style does with the root; "off": there is no such
// stage, as in a config without its table. Without the option it is as `options` has it, which
// outlives the command.
inline CLI::Option* add_root_option(CLI::App& command, std::optional<feet::RootOptions>& options) {
  const auto set = [&options](const std::string& word) {
    const feet::RootMode mode = *feet::root_mode(word);
    options.reset();
    if (mode != feet::RootMode::kOff) options = feet::RootOptions{.mode = mode};
  };
  const std::string usual = options ? "stride (the default)" : "stride";
  return command
      .add_option_function<std::string>(
          "--root", set,
          "Feet stand. " + usual +
              ": the root walks as far as the styled legs do; actor: it stays on the performer,"
              " and the legs reach for the ground; off" +
              (options ? "" : " (the default)") + ": it moves as it did, and feet slide")
      ->check(CLI::IsMember(
          std::vector<std::string>(feet::kRootModes.begin(), feet::kRootModes.end())));
}

// The word that the option has for it.
[[nodiscard]] inline std::string root_text(const std::optional<feet::RootOptions>& options) {
  return std::string(feet::root_name(options ? options->mode : feet::RootMode::kOff));
}

// How much of each style is mixed: {"feminine": 0.6, "elderly": 0.4}.
[[nodiscard]] inline Findings mixture_findings(const std::vector<std::string>& names,
                                               const style::Shares& shares) {
  Findings findings;
  for (std::size_t s = 0; s < names.size(); ++s) findings.add(names[s], shares.of[s]);
  return findings;
}

}  // namespace posed::tools
