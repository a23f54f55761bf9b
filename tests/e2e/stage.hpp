// Stage: a daemon for one test, in its own folder, on ephemeral ports.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "tests/e2e/outcome.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {

class Stage {
 public:
  // The beginning of each config; the streams follow.
  static constexpr const char* kEndpoints =
      "realtime = false\n[publish]\nendpoint = \"tcp://127.0.0.1:*\"\n"
      "[control]\nendpoint = \"tcp://127.0.0.1:*\"\n";

  // Behind them: the clip walk.bvh, again and again, as the stream walker.
  static constexpr const char* kWalker =
      "[[stream]]\nname = \"walker\"\ndriver = \"file\"\n"
      "[stream.file]\npath = \"walk.bvh\"\nloop = true\n";

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder.path() / name).string();
  }

  // Starts `posed COMMAND --config posed.toml` with these options, too, and waits until it is
  // ready.
  void launch(const std::string& command, const std::vector<std::string>& options = {},
              ChildStderr err = {}) {
    std::vector<std::string> arguments{command, "--config", path("posed.toml")};
    arguments.insert(arguments.end(), options.begin(), options.end());
    daemon.emplace(std::move(arguments), err, -1, most_files);
    const auto line = daemon->line();
    INFO(daemon->errors());
    REQUIRE(line);
    const auto ready = nlohmann::json::parse(*line);
    publish = ready.at("publish");
    control = ready.at("control");
  }

  void record() { launch("record", {"--out", path("take.plog"), "--frames"}); }

  // The log of record(), which has ended, gives the frames that were published, bit for bit.
  void check_replay() const {
    const ProgramOutcome replay = posed({"replay", path("take.plog"), "--speed", "max", "--expect"},
                                        std::chrono::minutes(10));  // of an hour of 16 streams
    INFO(replay.err);
    CHECK(replay.code == 0);
  }

  [[nodiscard]] ProgramOutcome ctl(std::vector<std::string> what) const {
    what.insert(what.begin(), {"ctl", "--connect", control});
    return posed(std::move(what));
  }

  // Waits until so many further frames of the stream have come, however long a busy machine needs.
  void await_frames(const std::string& stream, int count) const {
    const ProgramOutcome seen = posed(
        {"monitor", "--connect", publish, "--stream", stream, "--count", std::to_string(count)});
    INFO(seen.err);
    REQUIRE(seen.code == 0);
  }

  TempFolder folder;
  int most_files = 0;  // limit of open files of the daemon; 0: that of this process
  std::optional<Process> daemon;
  std::string publish, control;
};

}  // namespace posed::test
