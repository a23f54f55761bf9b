// The commands of `posed`, each in a file of its own. A command adds a CLI11 subcommand to `app`;
// its callback does the work and stores the exit code. To add one, write
// daemon/tools/<job>/<name>.cpp, declare it here and list it in daemon/tools/cli.cpp.
#pragma once

#include <memory>

#include "proto/frame/result.hpp"

namespace CLI {
class App;
}

namespace posed::tools {

class Ranks;

// Prints "posed: <sentence>" on stderr and returns the error's exit code.
[[nodiscard]] int report(const Error& error);
// The exit code of work: 0 when it is done, and as above when it failed.
[[nodiscard]] int report(const Result<>& work);

// Each adds one command.
void add_demo(CLI::App& app, int& exit_code);
void add_run(CLI::App& app, int& exit_code);
void add_relay(CLI::App& app, int& exit_code);
void add_record(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_synth(CLI::App& app, int& exit_code);
void add_convert(CLI::App& app, int& exit_code);
void add_render(CLI::App& app, int& exit_code);
void add_inspect(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_calibrate(CLI::App& app, int& exit_code);
void add_check(CLI::App& app, int& exit_code);
void add_devices(CLI::App& app, int& exit_code);
void add_doctor(CLI::App& app, int& exit_code);
void add_ctl(CLI::App& app, int& exit_code);
void add_monitor(CLI::App& app, int& exit_code);
void add_models(CLI::App& app, int& exit_code);
void add_top(CLI::App& app, int& exit_code);
void add_view(CLI::App& app, int& exit_code);
void add_keygen(CLI::App& app, int& exit_code);
void add_emulate(CLI::App& app, int& exit_code);
void add_completion(CLI::App& app, int& exit_code);
void add_man(CLI::App& app, int& exit_code);
void add_train_gesture(CLI::App& train, int& exit_code, const std::shared_ptr<Ranks>& ranks);
void add_train_style(CLI::App& train, int& exit_code, const std::shared_ptr<Ranks>& ranks);
void add_apply(CLI::App& app, int& exit_code);
void add_smooth(CLI::App& app, int& exit_code);
void add_eval_gesture(CLI::App& eval, int& exit_code);
void add_eval_natural(CLI::App& eval, int& exit_code);
void add_eval_style(CLI::App& eval, int& exit_code);
void add_bench(CLI::App& app, int& exit_code);

}  // namespace posed::tools
