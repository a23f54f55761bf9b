// `posed replay`: repeats the run in a log, from the log alone.
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>
#include <CLI/CLI.hpp>

#include "daemon/logging/log_output.hpp"
#include "daemon/tools/command/client.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/output_files.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/command/ranks.hpp"
#include "daemon/tools/logs/replay_outputs.hpp"
#include "daemon/tools/replay/broadcast.hpp"
#include "daemon/tools/replay/pace.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "models/gp/isa.hpp"
#include "models/task_numbers.hpp"
#include "proto/log/reader.hpp"

namespace posed::tools {
namespace {

// Replays several logs at once, each on one core, and compares each with its own frames: what CI
// does with all the logs that it keeps.
struct FarmOptions {
  std::vector<std::string> logs;
  std::string isa;    // empty: each log's own
  std::string junit;  // a file to write; empty: none
  bool json = false;
};

// A log before it is replayed.
struct FarmLog {
  std::string path, recorded_isa = "auto";
  std::int64_t first_ns = 0, length_ns = 0;
};

// The whole farm's progress, and whether to go on; shared by the threads.
struct Together {
  std::atomic<std::int64_t> replayed_ns = 0;
  std::atomic<bool> stop = false;
};

// A log that cannot be read has no length; its own replay says why.
FarmLog look_at(const std::string& path) {
  FarmLog log{.path = path};
  const auto reader = log::Reader::open(path);
  if (!reader) return log;
  log.recorded_isa = recorded_isa(*reader);
  if (const auto extent = reader->extent(); extent && *extent) {
    log.first_ns = (*extent)->first_ns;
    log.length_ns = (*extent)->last_ns - log.first_ns;
  }
  return log;
}

// Compares until `together` asks to stop.
Result<> compare(const FarmLog& log, Together& together, ReplayOutcome& outcome) {
  auto reader = TRY(log::Reader::open(log.path));
  auto opened = TRY(replay::Replay::open(reader));
  auto expectation = TRY(replay::Expectation::open(reader));
  outcome.missing = missing_from(reader, *opened);
  ReplayOutputs outputs(*opened);
  outputs.expectation = std::move(expectation);
  std::int64_t reported_ns = 0;
  const auto pace = [&](const log::ChunkRow& chunk) {
    if (static_cast<pipeline::Direction>(chunk.direction) == pipeline::Direction::kFromDevice) {
      const auto at_ns = std::clamp<std::int64_t>(chunk.arrival_ns - log.first_ns, reported_ns,
                                                  std::max(reported_ns, log.length_ns));
      together.replayed_ns += at_ns - reported_ns;
      reported_ns = at_ns;
    }
    return !together.stop && !outputs.difference;
  };
  auto done = opened->run([&](const pipeline::Item& item) { outputs.add(item); }, pace);
  if (done) done = outputs.finish();
  together.replayed_ns += log.length_ns - reported_ns;
  outcome.frames = outputs.frames;
  outcome.raw_frames = outputs.raw_frames;
  outcome.counts = outputs.expectation->counts();
  return done;
}

// An outcome as a task's numbers, and back.
TaskResult numbers_of(const ReplayOutcome& outcome) {
  NumberWriter numbers;
  for (const auto count :
       {outcome.frames, outcome.raw_frames, outcome.counts.compared, outcome.counts.lost,
        outcome.counts.after_gap, outcome.counts.past_end}) {
    numbers.add(static_cast<double>(count));
  }
  numbers.add(outcome.took_s);
  numbers.add(outcome.problem);
  for (const std::string& missing : outcome.missing) numbers.add(missing);
  return numbers.take();
}

ReplayOutcome outcome_of(const TaskResult& numbers) {
  NumberReader reader(numbers);
  const auto count = [&] { return static_cast<std::uint64_t>(reader.number()); };
  ReplayOutcome outcome;
  outcome.frames = count();
  outcome.raw_frames = count();
  outcome.counts.compared = count();
  outcome.counts.lost = count();
  outcome.counts.after_gap = count();
  outcome.counts.past_end = count();
  outcome.took_s = reader.number();
  outcome.problem = reader.text();
  while (!reader.at_end()) outcome.missing.push_back(reader.text());
  outcome.isa = gp::isa_name();
  return outcome;
}

// The logs by the instruction set that they are replayed on, because a process has one at a time.
std::map<std::string, std::vector<std::size_t>> groups_of(const std::vector<FarmLog>& logs,
                                                          const std::string& isa) {
  std::map<std::string, std::vector<std::size_t>> groups;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    groups[isa.empty() ? logs[i].recorded_isa : isa].push_back(i);
  }
  return groups;
}

Result<std::vector<ReplayOutcome>> replay_all(const std::vector<FarmLog>& logs,
                                              const std::string& isa) {
  ProgressBar bar(kQuietFor_s);
  ThreadTasks tasks;
  Together together;
  std::int64_t length_ns = 1;  // never 0
  for (const FarmLog& log : logs) length_ns += log.length_ns;
  std::vector<ReplayOutcome> outcomes(logs.size());
  std::size_t before = 0;  // logs of the groups that are done
  for (const auto& [recorded, members] : groups_of(logs, isa)) {
    TRY(set_isa_or(isa, recorded));
    const Task task = [&](std::size_t i) {
      ReplayOutcome outcome;
      const auto start = std::chrono::steady_clock::now();
      const auto done = compare(logs[members[i]], together, outcome);
      outcome.took_s =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      if (!done) outcome.problem = done.error().text();
      return numbers_of(outcome);
    };
    const auto found = tasks.run(members.size(), task, [&](std::size_t done) {
      const double share =
          static_cast<double>(together.replayed_ns) / static_cast<double>(length_ns);
      together.stop =
          !bar.show(fmt::format("replayed {} of {} logs", before + done, logs.size()), share);
      return !together.stop;
    });
    if (!found) return fail("interrupted: not all logs were compared");
    for (std::size_t i = 0; i < members.size(); ++i) outcomes[members[i]] = outcome_of((*found)[i]);
    before += members.size();
  }
  return outcomes;
}

std::string what_happened(const FarmLog& log, const ReplayOutcome& outcome) {
  std::string text = outcome.problem;
  if (text.empty()) {
    text = fmt::format("{}: {} frames are as published", log.path, outcome.counts.compared);
    const std::string rest = outcome.counts.not_compared();
    if (!rest.empty()) text += "; not compared: " + rest;
  }
  if (log.recorded_isa != "auto" && log.recorded_isa != outcome.isa) {
    text += fmt::format(" (recorded on {}, replayed on {}: the last bits may differ)",
                        log.recorded_isa, outcome.isa);
  }
  return text;
}

std::vector<JUnitCase> cases_of(const std::vector<FarmLog>& logs,
                                const std::vector<ReplayOutcome>& outcomes) {
  std::vector<JUnitCase> cases;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    cases.push_back(
        {.name = logs[i].path, .took_s = outcomes[i].took_s, .problem = outcomes[i].problem});
  }
  return cases;
}

// Prints one line for each log on stdout, in their order, and one sentence for all on stderr.
// Returns the exit code: 1 if a log differs or cannot be replayed, or after Ctrl-C, which ends it
// within a second.
int replay_farm(const FarmOptions& options) {
  std::vector<FarmLog> logs;
  logs.reserve(options.logs.size());
  for (const std::string& path : options.logs) logs.push_back(look_at(path));
  const auto outcomes = replay_all(logs, options.isa);
  if (!outcomes) return report(outcomes.error());
  if (!options.junit.empty()) {
    const auto written = write_junit(options.junit, cases_of(logs, *outcomes));
    if (!written) return report(written.error());
  }
  std::size_t differ = 0;
  replay::Expectation::Counts all;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const ReplayOutcome& outcome = (*outcomes)[i];
    differ += outcome.problem.empty() ? 0 : 1;
    all += outcome.counts;
    for (const std::string& missing : outcome.missing) {
      if (!options.json) spdlog::warn("{}: {}", logs[i].path, missing);
    }
    const std::string line = options.json
                                 ? findings_of(logs[i].path, logs[i].recorded_isa, outcome).json()
                                 : what_happened(logs[i], outcome);
    std::printf("%s\n", line.c_str());
  }
  std::fflush(stdout);
  if (differ == 0) {
    const std::string rest = all.not_compared();
    const std::string which =
        logs.size() == 1 ? "the log gives" : fmt::format("all {} logs give", logs.size());
    logging::say(fmt::format("posed: {} what was published, bit for bit{}", which,
                             rest.empty() ? rest : "; not compared: " + rest));
    return static_cast<int>(ExitCode::kDone);
  }
  return report(fail(fmt::format("{} of {} logs do not give what was published, or nothing of them "
                                 "could be compared",
                                 differ, logs.size()))
                    .error());
}

struct ReplayOptions {
  std::vector<std::string> logs;  // several: replay_farm
  std::string log;                // the first
  std::string speed;              // empty: 1 for a replay that is published, else max
  std::string out;
  std::string junit;
  std::string endpoint;
  std::string isa;
  bool publish = false;
  bool expect = false;
  bool overwrite = false;
  bool json = false;
};

// Waits until a chunk is due; returns false if the user wants to stop.
class Pacer {
 public:
  Pacer(std::string log, double speed)  // 0: as fast as possible
      : log_(std::move(log)), speed_(speed), pace_(speed) {}

  bool operator()(const log::ChunkRow& chunk) {
    if (speed_ == 0.0) return !Interrupt::came();
    const auto step = pace_.step(chunk);
    if (step.skipped_ns > 0) {
      spdlog::warn("{}: nothing came for {:.0f} s before chunk {}; that silence is skipped", log_,
                   seconds(step.skipped_ns), chunk.id);
    }
    const auto due = start_ + std::chrono::nanoseconds(step.due_ns);
    while (!Interrupt::came() && Steady::now() < due) {
      std::this_thread::sleep_until(
          std::min<Steady::time_point>(due, Steady::now() + std::chrono::milliseconds(50)));
    }
    return !Interrupt::came();
  }

 private:
  using Steady = std::chrono::steady_clock;
  std::string log_;
  double speed_;
  replay::Pace pace_;
  Steady::time_point start_ = Steady::now();
};

// Shows the progress of the replay once it takes long.
class ReplayProgress {
 public:
  explicit ReplayProgress(const std::optional<log::Reader::Extent>& extent) : extent_(extent) {}

  [[nodiscard]] double elapsed_s() const { return bar_.elapsed_s(); }

  void show(std::int64_t arrival_ns) {
    const auto now = std::chrono::steady_clock::now();
    if (!extent_ || now - shown_ < every_ || now - start_ < kQuiet) return;
    shown_ = now;
    const double whole_s = seconds(extent_->last_ns - extent_->first_ns);
    const double done_s = seconds(arrival_ns - extent_->first_ns);
    bar_.show(fmt::format("replayed {:.0f} of {:.0f} s", std::clamp(done_s, 0.0, whole_s), whole_s),
              whole_s > 0.0 ? done_s / whole_s : 1.0);
  }

 private:
  static constexpr std::chrono::milliseconds kQuiet{1000};
  const std::chrono::milliseconds every_{isatty(STDERR_FILENO) == 1 ? 200 : 5000};
  std::optional<log::Reader::Extent> extent_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point shown_{};
  ProgressBar bar_;
};

// Only a replay that somebody watches keeps the recording's pace by itself.
Result<double> speed_of(const ReplayOptions& options) {
  std::string text = options.speed;
  if (text.empty()) text = options.publish ? "1" : "max";
  if (text == "max") return 0.0;
  char* end = nullptr;
  const double speed = std::strtod(text.c_str(), &end);
  if (*end == '\0' && speed > 0.0 && speed <= 1000.0) return speed;
  return misuse("--speed is a factor above 0 and up to 1000 such as 1 or 0.5, or max, not '" +
                text + "'");
}

// Equal bits are guaranteed for one instruction set only: by default that of the log.
Result<> choose_isa(const ReplayOptions& options, const log::Reader& reader) {
  const std::string recorded = recorded_isa(reader);
  TRY(set_isa_or(options.isa, recorded));
  if (recorded != "auto" && recorded != gp::isa_name()) {
    spdlog::warn("recorded on {}, replayed on {}: the last bits may differ", recorded,
                 gp::isa_name());
  }
  return {};
}

// Each once: a body that comes back is another stream of the same name.
std::vector<std::string> stream_names(const log::Reader& reader) {
  std::vector<std::string> names;
  for (const log::StreamRow& row : reader.streams()) {
    if (std::ranges::find(names, row.name) == names.end()) names.push_back(row.name);
  }
  return names;
}

void print_summary(const ReplayOptions& options, const ReplayOutcome& outcome) {
  if (options.expect) {
    if (const std::string rest = outcome.counts.not_compared(); !rest.empty()) {
      spdlog::warn("not compared: {}", rest);
    }
    spdlog::info("{} frames are as published, bit for bit", outcome.counts.compared);
  }
  if (options.json) return;
  const std::string raw = outcome.raw_frames == 0 ? ""
                                                  : fmt::format(" ({} and {} raw ones)",
                                                                outcome.frames - outcome.raw_frames,
                                                                outcome.raw_frames);
  spdlog::info("{} frames{} replayed in {:.1f} s on {}", outcome.frames, raw, outcome.took_s,
               outcome.isa);
}

// A log that was compared has the same keys as one of several, also where it differs.
void print_json(const ReplayOptions& options, const std::string& recorded,
                const ReplayOutcome& outcome) {
  Findings findings;
  findings.add("frames", outcome.frames)
      .add("raw_frames", outcome.raw_frames)
      .add("isa", outcome.isa)
      .add("took_s", outcome.took_s);
  if (options.expect) findings = findings_of(options.log, recorded, outcome);
  findings.show(true, -1);
}

Result<> open_outputs(const ReplayOptions& options, double speed, const log::Reader& reader,
                      const replay::Replay& replay, ReplayOutputs& outputs) {
  if (options.expect) {
    auto expectation = TRY(replay::Expectation::open(reader));
    outputs.expectation = std::move(expectation);
  }
  if (!options.out.empty()) {
    auto file = TRY(FrameFile::create(options.out));
    outputs.file.emplace(std::move(file));
  }
  if (!options.publish) return {};
  const auto meta = reader.meta().find("publish_endpoint");
  std::string endpoint = meta == reader.meta().end() ? "" : meta->second;
  if (!options.endpoint.empty()) endpoint = options.endpoint;
  const auto extent = TRY(reader.extent());
  auto broadcast =
      TRY(replay::Broadcast::open({.endpoint = endpoint,
                                   .log = std::filesystem::path(options.log).filename().string(),
                                   .speed = speed,
                                   .begin_ns = extent ? extent->first_ns : 0},
                                  replay));
  outputs.broadcast = std::move(broadcast);
  Findings()
      .add("ready", true)
      .add("publish", outputs.broadcast->endpoint())
      .add("replay", options.log)
      .add("streams", stream_names(reader))
      .show(true, -1);
  return {};
}

// A replay that only publishes may end at any time; an incomplete file or comparison is a failure.
Result<> ended_early(const ReplayOptions& options, const ReplayOutputs& outputs) {
  const std::string what = fmt::format("interrupted after {} frames", outputs.frames);
  if (options.expect) return fail(what + ": those after them were not compared");
  if (!options.out.empty()) return fail(what + ": " + options.out + " was not written");
  spdlog::info("{}", what);
  return {};
}

Result<> replay(const ReplayOptions& options) {
  const auto speed = TRY(speed_of(options));
  TRY(OutputFiles(options.overwrite)
          .reads(options.log)
          .writes_any_but_other(options.out, {".bin"})
          .check());
  auto reader = TRY(log::Reader::open(options.log));
  TRY(choose_isa(options, reader));
  auto opened = TRY(replay::Replay::open(reader));
  replay::Replay& replay = *opened;
  ReplayOutcome outcome{.missing = missing_from(reader, replay)};
  for (const std::string& missing : outcome.missing) spdlog::warn("{}", missing);
  const auto extent = TRY(reader.extent());
  ReplayProgress progress(extent);
  // After the progress bar, because it takes over Ctrl-C, and before a file is begun that Ctrl-C
  // would leave.
  const Interrupt interrupt;
  ReplayOutputs outputs(replay);
  TRY(open_outputs(options, speed, reader, replay, outputs));
  Pacer pacer(options.log, speed);
  const auto pace = [&](const log::ChunkRow& chunk) {
    if (!pacer(chunk)) return false;
    if (static_cast<pipeline::Direction>(chunk.direction) != pipeline::Direction::kFromDevice) {
      return true;  // only chunks from a device have a time of their own
    }
    progress.show(chunk.arrival_ns);
    if (outputs.broadcast) outputs.broadcast->clock().reached(chunk.arrival_ns);
    return true;
  };
  auto done = replay.run([&](const pipeline::Item& item) { outputs.add(item); }, pace);
  if (done && Interrupt::came()) return ended_early(options, outputs);
  if (done) done = outputs.finish();
  outcome.frames = outputs.frames;
  outcome.raw_frames = outputs.raw_frames;
  if (outputs.expectation) outcome.counts = outputs.expectation->counts();
  outcome.isa = gp::isa_name();
  if (!done) outcome.problem = done.error().text();
  outcome.took_s = progress.elapsed_s();
  if (options.json && (done || options.expect)) print_json(options, recorded_isa(reader), outcome);
  if (done) print_summary(options, outcome);
  return done;
}

// Several logs, and those that a report is written about, are only compared.
int replay_several(const ReplayOptions& options) {
  const std::string what = options.junit.empty() ? "several logs are" : "with --junit logs are";
  Result<> usable{};
  if (!options.expect) {
    usable = misuse(what + " replayed to compare them: add --expect");
  } else if (options.publish || !options.out.empty()) {
    usable = misuse(what + " only compared; leave out --publish and --out");
  } else if (!options.speed.empty() && options.speed != "max") {
    usable = misuse(what + " replayed as fast as possible; leave out --speed");
  } else {
    usable = OutputFiles(options.overwrite)
                 .reads_all(options.logs)
                 .writes(options.junit, {".xml"})
                 .check();
  }
  if (!usable) return report(usable.error());
  return replay_farm({options.logs, options.isa, options.junit, options.json});
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("replay", "Compute a device log's frames again");
  auto options = std::make_shared<ReplayOptions>();
  command->add_option("log", options->logs, "The device log, or several with --expect")->required();
  command->add_option("--speed", options->speed,
                      "Times the recording's pace, or max: as fast as possible; default: 1 with "
                      "--publish, else max");
  auto* publish =
      command->add_flag("--publish", options->publish, "Publish where the recorded run did");
  command->add_option("--endpoint", options->endpoint, "With --publish: publish there instead")
      ->type_name("ENDPOINT")
      ->needs(publish);
  command->add_option("--out", options->out, "Write FRAMES.bin: {u32 length, posed.v1.Frame}...")
      ->type_name("FILE");
  add_overwrite_option(*command, options->overwrite);
  command->add_flag("--expect", options->expect, "Compare with the frames in the log, bit for bit");
  command
      ->add_option("--junit", options->junit,
                   "With --expect: write a test case for each log, as CI systems show them")
      ->type_name("FILE.xml");
  command->add_option("--isa", options->isa, "portable, avx2 or avx512; default: the log's own");
  command->add_flag("--json", options->json, "Print the counts as JSON");
  command->footer(
      R"(Nothing but the log is needed: it holds what the devices sent, the models, the settings
and every decision. On one instruction set the same log gives the same bits. --expect ends
with 1 and names stream, sequence and field of the first difference; also where nothing could
be compared, as after a gap at the log's start. A published replay says in its stats that it is
one; its times are the recording's, on the recording's clock. Nobody can control it. Examples:
  posed replay take1.plog --expect
  posed replay --expect takes/*.plog --junit replay.xml   # on all cores; 1 if one differs
  posed replay take1.plog --out FRAMES.bin
  posed replay take1.plog --publish     # and watch it: posed top)");
  command->callback([options, &exit_code] {
    if (options->logs.size() > 1 || !options->junit.empty()) {
      exit_code = replay_several(*options);
      return;
    }
    options->log = options->logs.front();
    exit_code = report(replay(*options));
  });
}

}  // namespace posed::tools
