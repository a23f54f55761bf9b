// The programs `posed` and `posed-mpi`: the table of commands and what parses the arguments.
#pragma once

#include <memory>

namespace CLI {
class App;
}

namespace posed::tools {

class Ranks;

// Parses the arguments and runs the command; returns the process's exit code (0 done, 1 failed, 2
// wrong use).
[[nodiscard]] int main_of(int argc, char** argv);

// The same for `posed-mpi`, which has `train` only: `ranks` train together.
[[nodiscard]] int train_main_of(int argc, char** argv, const std::shared_ptr<Ranks>& ranks);

// Adds all commands in the order in which `posed --help` lists them.
void add_commands(CLI::App& app, int& exit_code);

}  // namespace posed::tools
