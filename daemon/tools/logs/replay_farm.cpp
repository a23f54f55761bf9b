#include "daemon/tools/logs/replay_farm.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <map>
#include <optional>
#include <string_view>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include "daemon/logging/log_output.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/command/progress.hpp"
#include "daemon/tools/command/thread_tasks.hpp"
#include "daemon/tools/logs/missing_from_log.hpp"
#include "daemon/tools/logs/replay_outcome.hpp"
#include "daemon/tools/logs/replay_outputs.hpp"
#include "models/gp/isa.hpp"
#include "models/task_numbers.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/json_text.hpp"

namespace posed::tools {
namespace {

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
  auto reader = log::Reader::open(log.path);
  if (!reader) return std::unexpected(reader.error());
  auto opened = replay::Replay::open(*reader);
  if (!opened) return std::unexpected(opened.error());
  auto expectation = replay::Expectation::open(*reader);
  if (!expectation) return std::unexpected(expectation.error());
  outcome.missing = missing_from(*reader, **opened);
  ReplayOutputs outputs(**opened);
  outputs.expectation = std::move(*expectation);
  std::int64_t told_ns = 0;
  const auto pace = [&](const log::ChunkRow& chunk) {
    if (static_cast<pipeline::Direction>(chunk.direction) == pipeline::Direction::kFromDevice) {
      const auto at_ns = std::clamp<std::int64_t>(chunk.arrival_ns - log.first_ns, told_ns,
                                                  std::max(told_ns, log.length_ns));
      together.replayed_ns += at_ns - told_ns;
      told_ns = at_ns;
    }
    return !together.stop && !outputs.difference;
  };
  auto done = (*opened)->run([&](const pipeline::Item& item) { outputs.take(item); }, pace);
  if (done) done = outputs.finish();
  together.replayed_ns += log.length_ns - told_ns;
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
    if (auto set = set_isa_or(isa, recorded); !set) return std::unexpected(set.error());
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

}  // namespace

int replay_farm(const FarmOptions& options) {
  std::vector<FarmLog> logs;
  logs.reserve(options.logs.size());
  for (const std::string& path : options.logs) logs.push_back(look_at(path));
  const auto outcomes = replay_all(logs, options.isa);
  if (!outcomes) return report(outcomes.error());
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
                                 ? json_text(json_of(logs[i].path, logs[i].recorded_isa, outcome))
                                 : what_happened(logs[i], outcome);
    std::printf("%s\n", line.c_str());
  }
  std::fflush(stdout);
  if (differ == 0) {
    const std::string rest = all.not_compared();
    logging::say(fmt::format("posed: all {} logs give what was published, bit for bit{}",
                             logs.size(), rest.empty() ? rest : "; not compared: " + rest));
    return static_cast<int>(ExitCode::kDone);
  }
  return report(fail(fmt::format("{} of {} logs do not give what was published, or nothing of them "
                                 "could be compared",
                                 differ, logs.size()))
                    .error());
}

}  // namespace posed::tools
