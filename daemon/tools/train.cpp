#include <memory>

#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/ranks.hpp"

namespace posed::tools {

void add_train_for(CLI::App& app, int& exit_code, const std::shared_ptr<Ranks>& ranks) {
  CLI::App* train = app.add_subcommand("train", "Learn a model from clips");
  train->require_subcommand(1);
  add_train_style(*train, exit_code, ranks);
  add_train_gesture(*train, exit_code, ranks);
}

void add_train(CLI::App& app, int& exit_code) {
  add_train_for(app, exit_code, std::make_shared<OneRank>());
}

}  // namespace posed::tools
