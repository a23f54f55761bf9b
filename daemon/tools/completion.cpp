// Shell completion, generated from the same tree of commands that parses the arguments, so that it
// is always up to date.
#include <cstdio>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "proto/text/list.hpp"

namespace posed::tools {
namespace {

struct Word {
  std::string text, help;
};
struct Node {
  std::string path;  // "posed ctl"
  std::vector<Word> commands, flags;
};

std::string first_sentence(const std::string& text) {
  std::string out;
  for (const char c : text.substr(0, text.find('\n'))) {
    if (c != '\'' && c != '"' && c != '`' && c != '$' && c != '\\') out += c;
  }
  return out;
}

void collect(const CLI::App& app, const std::string& path, std::vector<Node>& nodes) {
  Node node{path, {}, {}};
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) {
      node.flags.push_back({"--" + name, first_sentence(option->get_description())});
    }
  }
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  for (const CLI::App* command : commands) {
    node.commands.push_back({command->get_name(), first_sentence(command->get_description())});
  }
  nodes.push_back(std::move(node));
  for (const CLI::App* command : commands) {
    collect(*command, path + " " + command->get_name(), nodes);
  }
}

// Follows the words before the cursor down the command tree, then offers the words of that command.
std::string bash(const std::vector<Node>& nodes) {
  std::string known, offers;
  for (const Node& node : nodes) {
    known += " '" + node.path + "'";
    offers += "    '" + node.path + "') words='" + joined(node.commands, " ", &Word::text) + " " +
              joined(node.flags, " ", &Word::text) + "' ;;\n";
  }
  return "# bash completion of posed: eval \"$(posed completion bash)\"\n"
         "_posed() {\n"
         "  local cur=${COMP_WORDS[COMP_CWORD]} path=posed words= i known\n"
         "  for ((i = 1; i < COMP_CWORD; i++)); do\n"
         "    for known in" +
         known +
         "; do\n"
         "      if [[ $known == \"$path ${COMP_WORDS[i]}\" ]]; then path=$known; break; fi\n"
         "    done\n"
         "  done\n"
         "  case $path in\n" +
         offers +
         "  esac\n"
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$cur\"))\n"
         "}\n"
         "complete -o default -F _posed posed\n";
}

std::string zsh(const std::vector<Node>& nodes) {
  std::string known, offers;
  for (const Node& node : nodes) {
    known += " '" + node.path + "'";
    offers += "    '" + node.path + "') offers=(";
    for (const auto* list : {&node.commands, &node.flags}) {
      for (const Word& word : *list) offers += "'" + word.text + ":" + word.help + "' ";
    }
    offers += ") ;;\n";
  }
  return "#compdef posed\n"
         "# zsh completion of posed: eval \"$(posed completion zsh)\"\n"
         "_posed() {\n"
         "  local where=posed i\n"
         "  local -a known offers\n"
         "  known=(" +
         known +
         ")\n"
         "  for ((i = 2; i < CURRENT; i++)); do\n"
         "    if (( ${known[(Ie)$where $words[i]]} )); then where=\"$where $words[i]\"; fi\n"
         "  done\n"
         "  case $where in\n" +
         offers +
         "  esac\n"
         "  _describe 'posed' offers\n"
         "  _files\n"
         "}\n"
         "compdef _posed posed\n";
}

std::string fish(const std::vector<Node>& nodes) {
  std::string out =
      "# fish completion of posed: posed completion fish | source\n"
      "function __posed_at\n"
      "  set -l path posed\n"
      "  set -l words (commandline -opc)\n"
      "  for word in $words[2..-1]\n"
      "    contains -- \"$path $word\"";
  for (const Node& node : nodes) out += " '" + node.path + "'";
  out += "; and set path \"$path $word\"\n  end\n  test \"$path\" = \"$argv[1]\"\nend\n";
  for (const Node& node : nodes) {
    const std::string at = "complete -c posed -n \"__posed_at '" + node.path + "'\"";
    for (const Word& word : node.commands) {
      out += at + " -f -a '" + word.text + "' -d '" + word.help + "'\n";
    }
    for (const Word& flag : node.flags) {
      out += at + " -l '" + flag.text.substr(2) + "' -d '" + flag.help + "'\n";
    }
  }
  return out;
}

}  // namespace

void add_completion(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("completion", "Print a shell's completion script");
  auto shell = std::make_shared<std::string>();
  command->add_option("shell", *shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  command->footer(R"help(Examples:
  eval "$(posed completion bash)"                                   # in ~/.bashrc
  posed completion fish > ~/.config/fish/completions/posed.fish)help");
  command->callback([&app, shell, &exit_code] {
    std::vector<Node> nodes;
    collect(app, "posed", nodes);
    const std::string script = *shell == "bash"  ? bash(nodes)
                               : *shell == "zsh" ? zsh(nodes)
                                                 : fish(nodes);
    std::fputs(script.c_str(), stdout);
    exit_code = 0;
  });
}

}  // namespace posed::tools
