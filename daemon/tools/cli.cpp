#include "daemon/tools/cli.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>
#include <span>
#include <string>
#include <utility>

#include <google/protobuf/stubs/logging.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cerrno>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>

#include "daemon/logging/log_output.hpp"
#include "daemon/system/last_words.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/ranks.hpp"
#include "drivers/transport/address.hpp"
#include "models/motion/vrm_animation.hpp"
#include "proto/clip/fbx.hpp"
#include "proto/clip/format.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/nearest_word.hpp"

namespace posed::tools {
namespace {

using AddCommand = void (*)(CLI::App& app, int& exit_code);

constexpr const char* kMpiFooter = R"(Examples:
  mpirun -n 8 posed-mpi train style --experiment styles.toml --out styles.style
  mpirun --hostfile hosts --map-by node --bind-to none posed-mpi train style ...

All ranks read the same files (a shared folder, or copies) and must be the same build on CPUs of
the same kind; what differs is named, and nothing is written. The model is the same file, bit for
bit, as that of `posed train`, whatever the number of ranks and threads. A rank has as many threads
as its share of the machine's cores, at most those that mpirun binds it to (--bind-to none: all).
Rank 0 prints and writes.)";

void add_train_for(CLI::App& app, int& exit_code, const std::shared_ptr<Ranks>& ranks) {
  CLI::App* train = app.add_subcommand("train", "Learn a model from clips");
  train->require_subcommand(1);
  add_train_style(*train, exit_code, ranks);
  add_train_gesture(*train, exit_code, ranks);
}

void add_train(CLI::App& app, int& exit_code) {
  add_train_for(app, exit_code, std::make_shared<OneRank>());
}

void add_eval(CLI::App& app, int& exit_code) {
  CLI::App* eval = app.add_subcommand("eval", "Judge a model, or a clip");
  eval->require_subcommand(1);
  add_eval_gesture(*eval, exit_code);
  add_eval_natural(*eval, exit_code);
  add_eval_style(*eval, exit_code);
}

constexpr auto kCommands = std::to_array<AddCommand>({
    add_demo,   add_run,        add_check,   add_doctor, add_devices, add_calibrate, add_record,
    add_replay, add_train,      add_apply,   add_smooth, add_synth,   add_convert,   add_render,
    add_eval,   add_ctl,        add_monitor, add_top,    add_view,    add_relay,     add_emulate,
    add_keygen, add_completion, add_man,     add_bench,  add_inspect, add_compare,   add_models,
});

// Whether the reader of stdout has gone (`posed monitor | head`).
bool reader_of_stdout_has_gone() {
  pollfd out{.fd = STDOUT_FILENO, .events = 0, .revents = 0};
  return ::poll(&out, 1, 0) == 1 && (out.revents & (POLLERR | POLLHUP)) != 0;
}

// Each thread of posed has a stack of this limit, and one that is too small ends the process
// without a word. The commands need up to 0.4 MB.
Result<> check_stack() {
  constexpr rlim_t kEnough = 1024 * 1024;
  rlimit stack{};
  if (getrlimit(RLIMIT_STACK, &stack) != 0 || stack.rlim_cur >= kEnough) return {};
  return fail("the stack is limited to " + std::to_string(stack.rlim_cur / 1024) +
              " KB, and posed needs 1024: raise it (ulimit -s 8192, LimitSTACK)");
}

// Before anything else of a program.
Result<> begin_program() {
  system::end_with_a_sentence();
  logging::protect_standard_descriptors();
  return check_stack();
}

// The exit code, 1 in place of 0 if the output could not be written (a full disk). A reader that
// has gone has read what it wanted; that is not a failure, and nothing is printed.
int with_stdout_written(int exit_code) {
  errno = 0;
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
  const std::string why = errno == 0 ? "" : " (" + errno_text() + ")";
  if (reader_of_stdout_has_gone()) return exit_code;
  const int failed =
      report(fail("the output cannot be written to stdout" + why + "; it is not complete").error());
  return exit_code != 0 ? exit_code : failed;
}

// The subcommand of `app` that bears this name; null if there is none.
CLI::App* subcommand(CLI::App& app, const std::string& name) {
  const auto all = app.get_subcommands([&](CLI::App* one) { return one->get_name() == name; });
  return all.empty() ? nullptr : all.front();
}

void add_options(const CLI::App& command, std::set<std::string>& known) {
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) known.insert(name);
  }
}

// Describes the first unknown command or option on the line, with the word that it most likely
// means; empty if all are known.
std::string unknown_word(CLI::App& app, std::span<char* const> arguments) {
  CLI::App* command = &app;
  std::set<std::string> options;
  add_options(app, options);
  bool after_option = false;  // then the word may be its value
  for (const std::string word : arguments) {
    const bool is_option = word.starts_with("-");
    const bool is_value = std::exchange(after_option, is_option) && !is_option;
    if (is_value) continue;
    if (CLI::App* next = subcommand(*command, word)) {
      command = next;
      add_options(*command, options);
      continue;
    }
    if (!is_option && word.ends_with(".toml") && command->get_option_no_throw("--config")) {
      return fmt::format("a config needs its option: --config {}", word);
    }
    std::set<std::string> commands;
    for (const CLI::App* one : command->get_subcommands(nullptr)) commands.insert(one->get_name());
    const std::string dashes = is_option ? "--" : "";  // which are no letters to be mistyped
    const std::string whole = word.substr(0, word.find('='));
    const std::string name = whole.substr(std::min(whole.find_first_not_of('-'), whole.size()));
    const auto& known = is_option ? options : commands;
    const std::string near = known.contains(name) ? "" : nearest(name, known);
    if (!near.empty()) {
      return fmt::format("there is no {} {}; the nearest is {}", is_option ? "option" : "command",
                         in_quotes(whole), dashes + near);
    }
    if (!is_option && !known.empty()) return fmt::format("there is no command {}", in_quotes(name));
  }
  return {};
}

// The library's own sentences quote an argument as it is, also an escape sequence.
void clean_complaints(CLI::App& app) {
  app.failure_message([](const CLI::App*, const CLI::Error& error) {
    return clean(error.what()) + "\nRun with --help for more information.\n";
  });
}

// `exit_code` is what the command stores.
int parse_and_run(int argc, char** argv, CLI::App& app, const int& exit_code) {
  // Untrusted bytes are refused with posed's own messages; protobuf would print a line for each.
  google::protobuf::SetLogHandler(nullptr);
  app.set_version_flag("--version", app.get_name() + " " POSED_VERSION);
  app.require_subcommand(1);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const std::string unknown =
        error.get_exit_code() == 0 ? "" : unknown_word(app, std::span(argv, argc).subspan(1));
    if (!unknown.empty()) return report(misuse(unknown + " (--help tells more)").error());
    const bool asked_for_help = app.exit(error) == 0;
    return static_cast<int>(asked_for_help ? ExitCode::kDone : ExitCode::kWrongUse);
  }
  return exit_code;
}

}  // namespace

void add_commands(CLI::App& app, int& exit_code) {
  clean_complaints(app);
  clip::add_format(motion::vrm_animation_format());
  clip::add_format(clip::fbx_format());
  for (const AddCommand add : kCommands) add(app, exit_code);
}

int main_of(int argc, char** argv) {
  if (const auto begun = begin_program(); !begun) return report(begun.error());
  const logging::LogOutput log;
  drivers::use_resolver(drivers::look_up);
  CLI::App app{"posed: live poses in, another style out", "posed"};
  int exit_code = 0;
  add_commands(app, exit_code);
  return with_stdout_written(parse_and_run(argc, argv, app, exit_code));
}

int train_main_of(int argc, char** argv, const std::shared_ptr<Ranks>& ranks) {
  if (const auto begun = begin_program(); !begun) return report(begun.error());
  const logging::LogOutput log;
  CLI::App app{"posed-mpi: posed train on the cores of many machines", "posed-mpi"};
  app.footer(kMpiFooter);
  clean_complaints(app);
  int exit_code = 0;
  add_train_for(app, exit_code, ranks);
  return with_stdout_written(parse_and_run(argc, argv, app, exit_code));
}

}  // namespace posed::tools
