#include <memory>

#include <CLI/CLI.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/config/config.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/run/recording.hpp"
#include "daemon/tools/run/serve.hpp"

namespace posed::tools {
namespace {

Result<> run(const ServeOptions& options) {
  prepare_to_serve();
  auto config = TRY(config::load_config(options.config, drivers::registry()));
  if (config.record) {
    return stream_and_record({.out = {},
                              .folder = config.record->folder,
                              .frames = config.record->frames,
                              .clips = config.record->clips,
                              .serve = options},
                             config);
  }
  auto daemon = TRY(assembly::Daemon::open(config));
  TRY(check_end(*daemon, options));
  TRY(daemon->start());
  print_ready(*daemon);
  serve(*daemon, options);
  return {};
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("run", "Stream as set in a config, until stopped");
  auto options = std::make_shared<ServeOptions>();
  add_serve_options(*command, *options);
  command->footer(
      "Once ready it prints one line of JSON on stdout with the endpoints really bound. SIGINT "
      "and\n"
      "SIGTERM end it cleanly. Examples:\n"
      "  posed run --config config/demo.toml\n"
      "  posed run --config mine.toml --until-end     # for clips with loop = false\n"
      "  posed run --config mine.toml                 # with a [record] table it records, too\n"
      "  posed monitor --count 10                     # in another terminal: see the poses");
  command->callback([options, &exit_code] { exit_code = report(run(*options)); });
}

}  // namespace posed::tools
