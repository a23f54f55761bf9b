// `posed record`: `run` with a device log.
#include <memory>

#include <CLI/CLI.hpp>

#include "daemon/config/config.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/run/recording.hpp"
#include "daemon/tools/run/serve.hpp"

namespace posed::tools {
namespace {

Result<> record(RecordingPlan plan) {
  prepare_to_serve();
  auto config = TRY(config::load_config(plan.serve.config, drivers::registry()));
  if (config.record) {
    plan.frames = plan.frames || config.record->frames;
    plan.clips = config.record->clips;
  }
  return stream_and_record(plan, config);
}

}  // namespace

void add_record(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("record", "Stream like `run` and keep a device log");
  auto options = std::make_shared<RecordingPlan>();
  add_serve_options(*command, options->serve);
  command->add_option("--out", options->out, "The log to write, usually NAME.plog")
      ->type_name("FILE")
      ->required();
  command->add_flag("--frames", options->frames, "Keep the published frames, too (for --expect)");
  command->add_flag("--overwrite,--force", options->overwrite,
                    "Replace the log if it is there already");
  command->add_flag("--json", options->json, "At the end print what was written as JSON");
  command->footer(
      "The log is one SQLite file: what each device sent, and every decision that decoding cannot\n"
      "repeat. kill -9 or a power cut costs at most the last 0.5 s. A full disk stops recording,\n"
      "not streaming; recording continues when there is space. Examples:\n"
      "  posed record --config mine.toml --out take1.plog --frames\n"
      "  posed replay take1.plog --speed max --out FRAMES.bin --expect\n"
      "  sqlite3 take1.plog 'SELECT name, driver FROM source'\n"
      "  posed ctl take start walk                    # in another terminal; then: posed ctl take "
      "stop\n"
      "  posed convert take1.plog --take walk --stream walker --out walk.bvh\n"
      "With a [record] table in the config `posed run` records, too; here --out says where.");
  command->callback([options, &exit_code] { exit_code = report(record(*options)); });
}

}  // namespace posed::tools
