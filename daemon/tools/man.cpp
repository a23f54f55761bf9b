// Manual pages, generated from the same tree of commands that parses the arguments, so that they
// say what `--help` says.
#include <cctype>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "proto/frame/whole_file.hpp"

namespace posed::tools {
namespace {

namespace fs = std::filesystem;

// Text as groff prints it unchanged: without this it would take quotes and hyphens for typographic
// ones, and a dot or a quote at the start of a line for a request.
std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '.' && (out.empty() || out.back() == '\n')) out += "\\&";
    switch (c) {
      case '\\':
        out += "\\(rs";
        break;
      case '-':
        out += "\\-";
        break;
      case '\'':
        out += "\\(aq";
        break;
      case '`':
        out += "\\(ga";
        break;
      case '^':
        out += "\\(ha";
        break;
      case '~':
        out += "\\(ti";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::string man_usage(const CLI::App& app, const std::string& path) {
  const std::string line = CLI::Formatter().make_usage(&app, path);
  return line.substr(line.find(": ") + 2);
}

// The arguments or the options of a command under a heading; nothing if it has none.
std::string man_options(const CLI::App& app, const std::string& heading, bool positional) {
  const CLI::Formatter formatter;
  std::string out;
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_positional() != positional) continue;
    out +=
        ".TP\n.B " +
        roff(formatter.make_option_name(option, positional) + formatter.make_option_opts(option)) +
        "\n" + roff(formatter.make_option_desc(option)) + "\n";
  }
  return out.empty() ? out : heading + "\n" + out;
}

// The examples and notes below `--help`, line for line.
std::string man_footer(const CLI::App& app, const std::string& heading) {
  const std::string text = app.get_footer();
  if (text.empty()) return {};
  return heading + "\n.nf\n" + roff(text) + (text.ends_with('\n') ? "" : "\n") + ".fi\n";
}

// A command of a command, such as `posed ctl set`, is a section of the other's page.
std::string man_section(const CLI::App& app, const std::string& path) {
  std::string out = ".SH " + roff(path) + "\n" + roff(app.get_description()) + ".\n.PP\n.B " +
                    roff(man_usage(app, path)) + man_options(app, ".PP\nArguments:", true) +
                    man_options(app, ".PP\nOptions:", false) + man_footer(app, ".PP");
  for (const CLI::App* command : commands_of(app)) {
    out += man_section(*command, path + " " + command->get_name());
  }
  return out;
}

std::string man_beginning(const CLI::App& app, const std::string& page, const std::string& path) {
  std::string title = page;
  for (char& c : title) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  // Without a date: the same commands give the same bytes.
  return ".TH " + roff(title) + R"( 1 "" "posed )" + POSED_VERSION +
         "\" \"User Commands\"\n.SH NAME\n" + roff(page) + R"( \- )" + roff(app.get_description()) +
         "\n.SH SYNOPSIS\n.B " + roff(man_usage(app, path)) +
         man_options(app, ".SH ARGUMENTS", true) + man_options(app, ".SH OPTIONS", false);
}

std::string man_page_of_command(const CLI::App& command) {
  const std::string path = "posed " + command.get_name();
  std::string out = man_beginning(command, "posed-" + command.get_name(), path);
  for (const CLI::App* part : commands_of(command)) {
    out += man_section(*part, path + " " + part->get_name());
  }
  return out + man_footer(command, ".SH EXAMPLES AND NOTES") + ".SH SEE ALSO\n.BR posed (1)\n";
}

std::string man_page_of_all(const CLI::App& app) {
  std::string out = man_beginning(app, "posed", "posed") + ".SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) {
    out += ".TP\n.BR " + roff("posed-" + command->get_name()) + " (1)\n" +
           roff(command->get_description()) + "\n";
  }
  return out + man_footer(app, ".SH EXAMPLES AND NOTES") +
         ".SH EXIT STATUS\n0: done. 1: failed, or the result is not usable. 2: wrong use.\n";
}

Result<> write_pages(const CLI::App& app, const fs::path& folder, bool overwrite) {
  std::vector<std::pair<fs::path, std::string>> pages{{folder / "posed.1", man_page_of_all(app)}};
  for (const CLI::App* command : commands_of(app)) {
    pages.emplace_back(folder / ("posed-" + command->get_name() + ".1"),
                       man_page_of_command(*command));
  }
  OutputFiles files(overwrite);
  for (const auto& [file, text] : pages) files.writes(file, {".1"});
  TRY(files.check());
  for (const auto& [file, text] : pages) TRY(write_whole_file(file, text));
  return {};
}

}  // namespace

void add_man(CLI::App& app, int& exit_code) {
  struct Options {
    std::string out;
    bool overwrite = false;
  };
  auto* command = app.add_subcommand("man", "Write the manual pages of all commands");
  const auto options = std::make_shared<Options>();
  command->add_option("--out", options->out, "Folder for posed.1 and posed-COMMAND.1")
      ->type_name("DIR")
      ->required();
  add_overwrite_option(*command, options->overwrite);
  command->footer(R"help(Examples:
  mkdir pages && posed man --out pages && man pages/posed-train.1
Packages and `cmake --install` bring these pages, which say what `--help` says.)help");
  command->callback([&app, options, &exit_code] {
    exit_code = report(write_pages(app, options->out, options->overwrite));
  });
}

}  // namespace posed::tools
