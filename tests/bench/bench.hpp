// The commands of posed_bench, which time posed or parts of it, many beside other programs and
// methods in the same run.
#pragma once

namespace CLI {
class App;
}

namespace posed::bench {

void add_bench_decoders(CLI::App& app, int& exit_code);
void add_bench_feet(CLI::App& app);
void add_bench_generate(CLI::App& app, int& exit_code);
void add_bench_json(CLI::App& app);
void add_bench_predict(CLI::App& app, int& exit_code);
void add_bench_relay(CLI::App& app, int& exit_code);
void add_bench_robot(CLI::App& app, int& exit_code);
void add_bench_smooth(CLI::App& app, int& exit_code);
void add_bench_stage(CLI::App& app, int& exit_code);

}  // namespace posed::bench
