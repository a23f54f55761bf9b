// Shared by the commands that serve (`run`, `record`, `demo`): start and end of serving.
#pragma once

#include <csignal>
#include <optional>
#include <string>
#include <vector>

#include "daemon/assembly/daemon.hpp"
#include "daemon/system/pulse.hpp"

namespace CLI {
class App;
}

namespace posed::tools {

// Call at the beginning of a command that serves. Blocks SIGINT, SIGTERM and SIGHUP in this thread
// and in all threads that it starts from now on, so that only serve() receives them: a signal that
// comes during the start stays pending and ends serve(). Also limits repeated log lines
// (sum_up_repeats()), because untrusted clients can cause them.
void prepare_to_serve();

// SIGINT, SIGTERM and SIGHUP.
[[nodiscard]] sigset_t end_signals();

// Prints one JSON line with the daemon's endpoints; waits at most 0.3 s for stdout, and warns if
// the line could not be written.
void print_ready(const assembly::Daemon& daemon);

struct ServeOptions {
  bool until_end = false;         // also end when every source that can end has ended
  std::optional<double> seconds;  // also end after this long
  std::string config;  // the TOML file, whose client list SIGHUP reads again; may be empty
};

// Adds --config (required), --seconds and --until-end.
void add_serve_options(CLI::App& command, ServeOptions& options);

// Refuses --until-end if no source can end.
Result<> check_end(const assembly::Daemon& daemon, const ServeOptions& options);

// Waits for SIGINT, SIGTERM, a control message or the end that the options set, then stops the
// daemon. SIGHUP reads the client list again if keys are used; otherwise it means a closed terminal
// and stops the daemon, unless systemd started it. Tells systemd that the daemon is ready, and that
// its threads and `more` make progress.
void serve(assembly::Daemon& daemon, const ServeOptions& options,
           std::vector<system::ThreadPulse> more = {});

}  // namespace posed::tools
