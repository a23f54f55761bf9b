// `posed record`: `run` with a recorder as the record sink.
#include <atomic>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <variant>

#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/assembly/daemon.hpp"
#include "daemon/cli/cli.hpp"
#include "daemon/cli/live/serve.hpp"
#include "daemon/cli/logs/no_body.hpp"
#include "daemon/cli/logs/set_aside.hpp"
#include "daemon/cli/output_files.hpp"
#include "daemon/config/config.hpp"
#include "daemon/record/recorder.hpp"
#include "daemon/system/clock.hpp"
#include "proto/text/json_text.hpp"

namespace posed::cli {
namespace {

struct RecordOptions {
  std::string out;
  bool frames = false;
  bool overwrite = false;
  bool json = false;
  ServeOptions serve;
};

// Publishes what the recorder reports on event/<stream> of the streams that it concerns.
void post(assembly::Daemon& daemon, const record::RecorderEvent& event) {
  const auto kind = event.kind == record::RecorderEvent::Kind::kGap
                        ? v1::Event::KIND_RECORDING_GAP
                        : v1::Event::KIND_RECORDING_ERROR;
  for (const std::uint32_t stream : event.streams) daemon.post_event(stream, kind, event.text);
}

// Datagrams that never came to posed. Those of a body's device count once, with its source.
std::uint64_t kernel_dropped(const v1::Stats& stats) {
  std::uint64_t dropped = 0;
  for (const v1::SourceStats& source : stats.source()) dropped += source.kernel_dropped();
  for (const v1::StreamStats& stream : stats.stream()) {
    if (stream.source_name().empty()) dropped += stream.kernel_dropped();
  }
  return dropped;
}

std::string missing_words(std::uint64_t lost, std::uint64_t errors, std::uint64_t dropped) {
  std::string words;
  if (lost + errors > 0) {
    words = fmt::format("{} chunks are missing after {} write errors; `posed replay` says where",
                        lost, errors);
  }
  if (dropped > 0) {
    words += fmt::format("{}the kernel dropped {} datagrams before posed could read them",
                         words.empty() ? "" : "; ", dropped);
  }
  return words.empty() ? "nothing is missing" : words;
}

// Prints a summary. Gaps were already reported when they happened.
void print_result(const RecordOptions& options, const v1::Stats& stats,
                  const record::Recorder& recorder, double took_s) {
  std::error_code ignored;
  const auto bytes = std::filesystem::file_size(options.out, ignored);
  std::uint64_t frames = stats.left_frames(), samples = stats.left_samples();
  const bool some_left = frames + samples > 0;
  nlohmann::ordered_json streams = nlohmann::ordered_json::array();
  for (const v1::StreamStats& stream : stats.stream()) {
    frames += stream.frames();
    samples += stream.samples();
    streams.push_back(
        {{"stream", stream.stream()}, {"frames", stream.frames()}, {"samples", stream.samples()}});
  }
  const std::uint64_t lost = recorder.lost_chunks(), errors = recorder.errors();
  const std::uint64_t dropped = kernel_dropped(stats);
  if (options.json) {
    const nlohmann::ordered_json line{{"file", options.out},
                                      {"seconds", took_s},
                                      {"bytes", bytes},
                                      {"frames", frames},
                                      {"samples", samples},
                                      {"streams", streams},
                                      {"left_frames", stats.left_frames()},
                                      {"left_samples", stats.left_samples()},
                                      {"missing_chunks", lost},
                                      {"kernel_dropped", dropped},
                                      {"write_errors", errors}};
    std::printf("%s\n", json_text(line).c_str());
    std::fflush(stdout);
  }
  spdlog::log(lost + errors + dropped > 0 ? spdlog::level::warn : spdlog::level::info,
              "{}: {:.1f} s of {} stream{}{}, {} frames and {} samples published, {:.1f} MB; {}",
              options.out, took_s, stats.stream_size(), stats.stream_size() == 1 ? "" : "s",
              some_left ? " and those that have left" : "", frames, samples,
              static_cast<double>(bytes) / 1e6, missing_words(lost, errors, dropped));
}

void add_models(OutputFiles& files, const config::StreamConfig& stream) {
  for (const config::StageConfig& stage : stream.stages) files.reads(stage.model);
}

void add_clip(OutputFiles& files, const drivers::Options& options) {
  const auto path = options.find("path");
  if (path == options.end()) return;
  if (const auto* clip = std::get_if<std::string>(&path->second)) files.reads(*clip);
}

// The log must not be one of the files that the daemon reads.
Result<> check_out(const RecordOptions& options, const config::DaemonConfig& config) {
  OutputFiles files(options.overwrite);
  files.reads(options.serve.config).writes_any_but_other(options.out, {".plog"});
  for (const config::StreamConfig& stream : config.streams) {
    files.reads(stream.calibration);
    add_models(files, stream);
    add_clip(files, stream.options);
  }
  for (const config::SourceConfig& source : config.sources) {
    add_models(files, source.every);
    for (const auto& named : source.named) add_models(files, named.stream);
    add_clip(files, source.options);
  }
  return files.check();
}

Result<> record(const RecordOptions& options) {
  prepare_to_serve();
  auto config = config::load_config(options.serve.config, drivers::registry());
  if (!config) return std::unexpected(config.error());
  if (auto fine = check_out(options, *config); !fine) return fine;
  auto opened = assembly::Daemon::open(*config);
  if (!opened) return std::unexpected(opened.error());
  assembly::Daemon& daemon = **opened;
  if (auto sound = check_end(daemon, options.serve); !sound) return sound;
  auto started = std::make_shared<std::atomic<bool>>(false);
  record::RecorderOptions recorder_options{
      .file = options.out,
      .overwrite = options.overwrite,
      .frames = options.frames,
      .config_text = config->text,
      .publish_endpoint = config->publish_endpoint,
      .clock = system::monotonic_ns,
      .report = [&daemon, started](const record::RecorderEvent& event) {
        if (*started) post(daemon, event);
      }};
  auto replaced = SetAside::move(options.out);
  if (!replaced) return std::unexpected(replaced.error());
  std::set<std::string> with_body;
  auto recorder = record::Recorder::open(
      std::move(recorder_options),
      record::recorded_setup(daemon.streams(), daemon.sources(), daemon.slots_to_come()));
  if (!recorder) return std::unexpected(recorder.error());
  assembly::DaemonHooks hooks;
  hooks.record_sink = &(*recorder)->record_sink();
  hooks.record_stream = [&recorder, &with_body](const devices::NewStream& stream) {
    with_body.insert(stream.source.config.name);
    (*recorder)->add_stream(record::recorded_stream(stream));
  };
  hooks.more_stats = [&recorder](v1::Stats& stats) {
    stats.set_recorder_lost_chunks((*recorder)->lost_chunks());
    stats.set_recorder_errors((*recorder)->errors());
    stats.set_recorder_file((*recorder)->file().string());
  };
  if (auto done = daemon.start(std::move(hooks)); !done) {
    daemon.stop();
    static_cast<void>((*recorder)->finish());
    std::error_code ignored;
    std::filesystem::remove(options.out, ignored);  // nothing was recorded
    return done;
  }
  replaced->let_go();
  *started = true;
  print_ready(daemon);
  const std::int64_t start_ns = system::monotonic_ns();
  serve(daemon, options.serve);
  const double took_s = seconds(system::monotonic_ns() - start_ns);
  auto finished = (*recorder)->finish();
  for (const auto& source : daemon.sources()) {
    if (!with_body.contains(source->config.name)) warn_of_no_body(source->config.name);
  }
  print_result(options, daemon.stats(), **recorder, took_s);
  return finished;
}

}  // namespace

void add_record(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("record", "Stream like `run` and keep a device log");
  auto options = std::make_shared<RecordOptions>();
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
      "  sqlite3 take1.plog 'SELECT name, driver FROM source'");
  command->callback([options, &exit_code] {
    const auto done = record(*options);
    exit_code = done ? 0 : report(done.error());
  });
}

}  // namespace posed::cli
