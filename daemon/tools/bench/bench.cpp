#include <CLI/CLI.hpp>

#include "daemon/tools/command/command.hpp"

namespace posed::tools {

void add_bench(CLI::App& app, int& exit_code) {
  CLI::App* bench = app.add_subcommand("bench", "Measure, as ratios within one run");
  bench->require_subcommand(1);
  add_bench_predict(*bench, exit_code);
  add_bench_pipeline(*bench, exit_code);
  add_bench_decoders(*bench, exit_code);
  add_bench_stage(*bench, exit_code);
  add_bench_relay(*bench, exit_code);
}

}  // namespace posed::tools
