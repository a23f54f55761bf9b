#include "daemon/cli/cli.hpp"

#include <array>
#include <cstdio>

#include <google/protobuf/stubs/logging.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

namespace posed::cli {
namespace {

using AddCommand = void (*)(CLI::App& app, int& exit_code);

// The order in which `posed --help` lists them.
constexpr auto kCommands = std::to_array<AddCommand>({
    add_demo,    add_run,   add_check,   add_devices, add_calibrate,  add_record, add_replay,
    add_train,   add_apply, add_smooth,  add_synth,   add_convert,    add_eval,   add_ctl,
    add_monitor, add_top,   add_emulate, add_keygen,  add_completion, add_bench,
});

}  // namespace

int report(const Error& error) {
  std::fprintf(stderr, "posed: %s\n", error.text().c_str());
  return static_cast<int>(error.exit_code);
}

int main_of(int argc, char** argv) {
  spdlog::set_default_logger(spdlog::stderr_color_mt("posed"));
  // Bytes of strangers are refused in our own words; protobuf would write a line for each.
  google::protobuf::SetLogHandler(nullptr);
  CLI::App app{"posed: live poses in, another style out", "posed"};
  app.set_version_flag("--version", "posed " POSED_VERSION);
  app.require_subcommand(1);
  int exit_code = 0;
  for (const AddCommand add : kCommands) add(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool asked_for_help = app.exit(error) == 0;
    return static_cast<int>(asked_for_help ? ExitCode::kDone : ExitCode::kWrongUse);
  }
  return exit_code;
}

}  // namespace posed::cli
