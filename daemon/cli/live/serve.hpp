// What the commands that serve (`run`, `record`, `demo`) share: being ready, and ending.
#pragma once

#include <optional>
#include <string>

#include "daemon/assembly/daemon.hpp"

namespace CLI {
class App;
}

namespace posed::cli {

// For the beginning of a command that serves. Blocks SIGINT, SIGTERM and SIGHUP in this thread and
// all that it starts from now on, so that only serve() hears them: one that comes during the start
// waits there and ends it. What strangers make the daemon say is summed up in the log.
void prepare_to_serve();

// Prints the one JSON line that says where the daemon is to be found; waits at most 0.3 s for
// stdout, and warns when it does not take the line.
void print_ready(const assembly::Daemon& daemon);

struct ServeOptions {
  bool until_end = false;         // also end when every source that can has
  std::optional<double> seconds;  // also end after this long
  std::string config;             // the TOML file; SIGHUP reads its client list again; may be empty
};

// --config (required), --seconds and --until-end.
void add_serve_options(CLI::App& command, ServeOptions& options);

// Refuses --until-end where nothing ever ends.
[[nodiscard]] Result<> check_end(const assembly::Daemon& daemon, const ServeOptions& options);

// Waits for SIGINT, SIGTERM, a control message or what the options say, then stops the daemon.
// SIGHUP reads the client list again where keys are used; elsewhere it is a closed terminal and
// ends.
void serve(assembly::Daemon& daemon, const ServeOptions& options);

}  // namespace posed::cli
