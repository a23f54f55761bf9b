// Every command line of posed in a README names a command that exists, with options that it has.
#include <algorithm>
#include <cstddef>
#include <optional>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <catch2/catch.hpp>

#include "daemon/tools/cli.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/readme_blocks.hpp"

namespace posed::tools {
namespace {

using Words = std::vector<std::string>;

// The words of a shell's line, without its comment; what is in quotes is one word.
Words words_of(const std::string& line) {
  if (line.starts_with('#')) return {};
  return CLI::detail::split_up(line.substr(0, line.find(" #")));
}

// Those behind `posed`, for each time that it is started in the line.
std::vector<Words> starts_of(const Words& line) {
  std::vector<Words> starts;
  bool first = true, inside = false;
  for (const std::string& word : line) {
    if (word == "&&" || word == "|" || word == ";" || word == ">" || word == "<" || word == "&") {
      first = word != ">" && word != "<";
      inside = false;
    } else if (first && (word == "posed" || word == "build/bin/posed")) {
      starts.emplace_back();
      inside = true;
      first = false;
    } else if (inside) {
      starts.back().push_back(word);
    } else {
      first = false;
    }
  }
  return starts;
}

bool takes_words(const CLI::App& command) {
  const auto options = command.get_options();
  return std::ranges::any_of(options, [](const CLI::Option* one) { return one->get_positional(); });
}

CLI::App* subcommand(CLI::App& command, const std::string& name) {
  const auto all = command.get_subcommands([&](CLI::App* one) { return one->get_name() == name; });
  return all.empty() ? nullptr : all.front();
}

// What is wrong with these words behind `posed`; nothing if they could be typed.
std::optional<std::string> complaint(CLI::App& app, const Words& words) {
  CLI::App* command = &app;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (word == "..." || word == "COMMAND") return {};
    if (word.starts_with("--")) {
      const std::string name = word.substr(0, word.find('='));
      const CLI::Option* option = nullptr;
      for (CLI::App* at = command; at != nullptr && option == nullptr; at = at->get_parent()) {
        option = at->get_option_no_throw(name);
      }
      if (option == nullptr) return "posed " + command->get_name() + " has no option " + name;
      if (option->get_items_expected_min() > 0 && !word.contains('=')) ++i;
    } else if (CLI::App* const next = subcommand(*command, word)) {
      command = next;
    } else if (!takes_words(*command) &&
               !command->get_subcommands([](auto*) { return true; }).empty()) {
      return "posed " + command->get_name() + " has no command " + word;
    }
  }
  return {};
}

// The command lines of a page: those in blocks, and those that its text names.
std::vector<std::string> lines_of(const std::string& page) {
  static const std::regex kContinued("\\\\\n *");
  static const std::regex kInline("`(posed [^`]*)`");
  const std::string text = std::regex_replace(page, kContinued, "");
  std::vector<std::string> lines;
  std::istringstream all(text);
  bool inside = false;
  for (std::string line; std::getline(all, line);) {
    if (line.starts_with("```")) inside = !inside;
    if (inside) lines.push_back(line);
  }
  for (std::sregex_iterator at(text.begin(), text.end(), kInline), end; at != end; ++at) {
    lines.push_back(std::regex_replace((*at)[1].str(), std::regex("\n *"), " "));
  }
  return lines;
}

TEST_CASE("command lines are read as a shell reads them, and wrong ones are found") {
  CLI::App app{"", "posed"};
  int exit_code = 0;
  add_commands(app, exit_code);
  const auto wrong = [&](const std::string& line) {
    std::string all;
    for (const Words& start : starts_of(words_of(line))) {
      all += complaint(app, start).value_or("");
    }
    return all;
  };
  CHECK(starts_of(words_of("posed check --config a.toml && posed run --config a.toml  # posed x"))
            .size() == 2);
  CHECK(starts_of(words_of("ninja posed e2e; systemctl status posed@stage")).empty());
  CHECK(wrong("posed ctl set walker alpha 0.5").empty());
  CHECK(wrong("posed top --record \"a b.jsonl\" --overwrite > out").empty());
  CHECK(wrong("posed top --recrod a.jsonl") == "posed top has no option --recrod");
  CHECK(wrong("cd x && posed tpo") == "posed posed has no command tpo");
  CHECK(wrong("posed train dance --out x") == "posed train has no command dance");
}

TEST_CASE("every command line in a README exists") {
  CLI::App app{"", "posed"};
  app.set_version_flag("--version", "");
  int exit_code = 0;
  add_commands(app, exit_code);
  std::size_t tried = 0;
  for (const auto& path : test::readme_files()) {
    for (const std::string& line : lines_of(test::file_text(path))) {
      for (const Words& start : starts_of(words_of(line))) {
        ++tried;
        if (const auto wrong = complaint(app, start))
          FAIL_CHECK(path << ": " << line << ": " << *wrong);
      }
    }
  }
  CHECK(tried > 100);
}

}  // namespace
}  // namespace posed::tools
