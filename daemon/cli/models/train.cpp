#include <CLI/CLI.hpp>

#include "daemon/cli/cli.hpp"

namespace posed::cli {

void add_train(CLI::App& app, int& exit_code) {
  CLI::App* train = app.add_subcommand("train", "Learn a model from clips");
  train->require_subcommand(1);
  add_train_style(*train, exit_code);
  add_train_gesture(*train, exit_code);
}

}  // namespace posed::cli
