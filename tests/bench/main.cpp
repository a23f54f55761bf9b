// posed_bench: the benchmarks of those who change posed. A user judges his own machine with
// `posed bench pipeline`.
#include <CLI/CLI.hpp>

#include "proto/frame/result.hpp"
#include "tests/bench/bench.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Times posed and its parts, beside other programs and methods in the same run",
               "posed_bench"};
  app.require_subcommand(1);
  int exit_code = 0;
  posed::bench::add_bench_decoders(app, exit_code);
  posed::bench::add_bench_feet(app);
  posed::bench::add_bench_generate(app, exit_code);
  posed::bench::add_bench_json(app);
  posed::bench::add_bench_predict(app, exit_code);
  posed::bench::add_bench_relay(app, exit_code);
  posed::bench::add_bench_robot(app, exit_code);
  posed::bench::add_bench_smooth(app, exit_code);
  posed::bench::add_bench_stage(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : static_cast<int>(posed::ExitCode::kWrongUse);
  }
  return exit_code;
}
