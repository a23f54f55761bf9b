#include "daemon/cli/logs/replay_farm.hpp"

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstdio>
#include <map>
#include <optional>
#include <string_view>

#include <spdlog/fmt/fmt.h>
#include <nlohmann/json.hpp>

#include "daemon/cli/cli.hpp"
#include "daemon/cli/logs/replay_outputs.hpp"
#include "daemon/cli/models/thread_tasks.hpp"
#include "daemon/cli/progress.hpp"
#include "models/gp/isa.hpp"
#include "models/task_numbers.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/json_text.hpp"

namespace posed::cli {
namespace {

// A log before it is replayed.
struct FarmLog {
  std::string path, recorded_isa = "auto";
  std::int64_t first_ns = 0, length_ns = 0;
};

// What became of it.
struct Outcome {
  std::uint64_t frames = 0;
  replay::Expectation::Counts counts;
  std::string isa;      // on which it was replayed
  std::string problem;  // empty: all as published
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
Result<> compare(const FarmLog& log, Together& together, Outcome& outcome) {
  auto reader = log::Reader::open(log.path);
  if (!reader) return std::unexpected(reader.error());
  auto opened = replay::Replay::open(*reader);
  if (!opened) return std::unexpected(opened.error());
  auto expectation = replay::Expectation::open(*reader);
  if (!expectation) return std::unexpected(expectation.error());
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
  outcome.counts = outputs.expectation->counts();
  return done;
}

// An outcome as a task's numbers, and back.
TaskResult numbers_of(const Outcome& outcome) {
  NumberWriter numbers;
  for (const auto count : {outcome.frames, outcome.counts.compared, outcome.counts.lost,
                           outcome.counts.after_gap, outcome.counts.past_end}) {
    numbers.add(static_cast<double>(count));
  }
  return numbers.add(outcome.problem).take();
}

Outcome outcome_of(const TaskResult& numbers) {
  NumberReader reader(numbers);
  const auto count = [&] { return static_cast<std::uint64_t>(reader.number()); };
  Outcome outcome;
  outcome.frames = count();
  outcome.counts.compared = count();
  outcome.counts.lost = count();
  outcome.counts.after_gap = count();
  outcome.counts.past_end = count();
  outcome.problem = reader.text();
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

Result<std::vector<Outcome>> replay_all(const std::vector<FarmLog>& logs, const std::string& isa) {
  ProgressBar bar(kQuietFor_s);
  ThreadTasks tasks;
  Together together;
  std::int64_t length_ns = 1;  // never 0
  for (const FarmLog& log : logs) length_ns += log.length_ns;
  std::vector<Outcome> outcomes(logs.size());
  std::size_t before = 0;  // logs of the groups that are done
  for (const auto& [recorded, members] : groups_of(logs, isa)) {
    if (auto set = set_isa_or(isa, recorded); !set) return std::unexpected(set.error());
    const Task task = [&](std::size_t i) {
      Outcome outcome;
      const auto done = compare(logs[members[i]], together, outcome);
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

std::string what_happened(const FarmLog& log, const Outcome& outcome) {
  const auto& counts = outcome.counts;
  std::string text = outcome.problem;
  if (text.empty()) {
    text = fmt::format("{}: {} frames are as published", log.path, counts.compared);
  }
  if (const auto not_compared = counts.lost + counts.after_gap + counts.past_end;
      not_compared > 0) {
    text += fmt::format(", {} are not in the log", not_compared);
  }
  if (log.recorded_isa != "auto" && log.recorded_isa != outcome.isa) {
    text += fmt::format(" (recorded on {}, replayed on {}: the last bits may differ)",
                        log.recorded_isa, outcome.isa);
  }
  return text;
}

nlohmann::ordered_json json_of(const FarmLog& log, const Outcome& outcome) {
  nlohmann::ordered_json line{{"log", log.path},
                              {"same", outcome.problem.empty()},
                              {"frames", outcome.frames},
                              {"compared", outcome.counts.compared},
                              {"lost", outcome.counts.lost},
                              {"after_gap", outcome.counts.after_gap},
                              {"past_end", outcome.counts.past_end},
                              {"isa", outcome.isa},
                              {"recorded_isa", log.recorded_isa}};
  if (!outcome.problem.empty()) line["problem"] = outcome.problem;
  return line;
}

}  // namespace

int replay_farm(const FarmOptions& options) {
  std::vector<FarmLog> logs;
  for (const std::string& path : options.logs) logs.push_back(look_at(path));
  const auto outcomes = replay_all(logs, options.isa);
  if (!outcomes) return report(outcomes.error());
  std::size_t differ = 0;
  for (std::size_t i = 0; i < logs.size(); ++i) {
    const Outcome& outcome = (*outcomes)[i];
    differ += outcome.problem.empty() ? 0 : 1;
    const std::string line =
        options.json ? json_text(json_of(logs[i], outcome)) : what_happened(logs[i], outcome);
    std::printf("%s\n", line.c_str());
  }
  std::fflush(stdout);
  if (differ == 0) {
    std::fprintf(stderr, "posed: all %zu logs give what was published, bit for bit\n", logs.size());
    return static_cast<int>(ExitCode::kDone);
  }
  return report(
      fail(fmt::format("{} of {} logs do not give what was published", differ, logs.size()))
          .error());
}

}  // namespace posed::cli
