// Options of a replay besides the comparison of frames: speed, publishing, instruction set; and a
// recording on a full disk.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <sys/resource.h>

#include "posed/v1/posed.pb.h"
#include "tests/e2e/outcome.hpp"
#include "tests/e2e/served.hpp"
#include "tests/support/log_surgery.hpp"
#include "tests/support/shared.hpp"

namespace posed::test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

// A copy of the golden log, because opening a log modifies it (merges its -wal file).
std::string staged_log(const TempFolder& folder) {
  const auto copy = folder.path() / "staged.plog";
  std::filesystem::copy_file(golden("replay/staged.plog"), copy);
  return copy.string();
}

// FRAMES.bin: repeated {u32 length, posed.v1.Frame}.
std::vector<v1::Frame> frames_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<v1::Frame> frames;
  std::uint32_t size = 0;
  while (file.read(reinterpret_cast<char*>(&size), sizeof size)) {
    std::string bytes(size, '\0');
    REQUIRE(file.read(bytes.data(), size));
    REQUIRE(frames.emplace_back().ParseFromString(bytes));
  }
  return frames;
}

}  // namespace

TEST_CASE("a replay keeps the recording's own timing and publishes as the run did") {
  const TempFolder folder;
  const std::string log = staged_log(folder);
  const auto begin = std::chrono::steady_clock::now();
  Process replay({"replay", log, "--speed", "0.1", "--publish", "--endpoint", "tcp://127.0.0.1:*"});
  const auto line = replay.line();
  INFO(replay.errors());
  REQUIRE(line);
  const std::string endpoint = json::parse(*line).at("publish");
  const ProgramOutcome seen = posed({"monitor", "--connect", endpoint, "--json", "--count", "5"});
  INFO(seen.err);
  REQUIRE(seen.code == 0);
  const json frame = json::parse(seen.out.substr(0, seen.out.find('\n')));
  CHECK(frame.contains("sequence"));
  REQUIRE(replay.exit_code() == 0);
  // Slower is possible on a busy machine; faster would be wrong.
  const auto max =
      posed({"replay", log, "--speed", "max", "--out", (folder.path() / "f").string()});
  REQUIRE(max.code == 0);
  const auto frames = frames_of(folder.path() / "f");
  REQUIRE(frames.size() > 2);
  const double take_s = seconds(frames.back().arrival_ns() - frames.front().arrival_ns());
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  CHECK(took.count() >= 10.0 * take_s);
}

TEST_CASE("one wrong time in a log does not stop a timed replay: it is skipped and reported") {
  const TempFolder folder;
  const std::string log = staged_log(folder);
  forge(log, "UPDATE chunk SET arrival_ns = arrival_ns + 86400000000000 WHERE id = 20");
  const ProgramOutcome paced =
      posed({"replay", log, "--speed", "1", "--out", (folder.path() / "paced.bin").string()});
  INFO(paced.err);
  CHECK(paced.code == 0);
  CHECK(has(paced.err, "staged.plog: ... 86400 s ... chunk 20"));
  const ProgramOutcome fast =
      posed({"replay", log, "--speed", "max", "--out", (folder.path() / "fast.bin").string()});
  CHECK(fast.code == 0);
  CHECK_FALSE(has(fast.err, "nothing came"));
  CHECK(frames_of(folder.path() / "paced.bin").size() ==
        frames_of(folder.path() / "fast.bin").size());
}

TEST_CASE("a row that does not match its checksum ends a replay, with log, table and row") {
  const TempFolder folder;
  const auto log = folder.path() / "staged.plog";
  std::filesystem::copy_file(golden("replay/staged.plog"), log);
  run_sql(log, "UPDATE chunk SET arrival_ns = arrival_ns + 1 WHERE id = 20");
  const ProgramOutcome replay = posed({"replay", log.string(), "--speed", "max"});
  CHECK(replay.code == 1);
  CHECK(has(replay.err, "staged.plog: ... damaged ... row 20 ... chunk"));
}

TEST_CASE("a replay on another instruction set differs in the last bits at most") {
  const TempFolder folder;
  const std::string log = staged_log(folder);
  const auto replay = [&](const std::string& isa, const std::string& out) {
    return posed({"replay", log, "--speed", "max", "--isa", isa, "--out",
                  (folder.path() / out).string(), "--json"});
  };
  const ProgramOutcome portable = replay("portable", "portable.bin");
  INFO(portable.err);
  REQUIRE(portable.code == 0);
  CHECK(json::parse(portable.out).at("isa") == "portable");
  CHECK(replay("sparc", "no.bin").code == 2);
  const ProgramOutcome other = posed(
      {"replay", log, "--speed", "max", "--out", (folder.path() / "own.bin").string(), "--json"});
  REQUIRE(other.code == 0);
  const auto a = frames_of(folder.path() / "portable.bin");
  const auto b = frames_of(folder.path() / "own.bin");
  REQUIRE(!a.empty());
  REQUIRE(a.size() == b.size());
  float worst = 0.0F;
  for (std::size_t i = 0; i < a.size(); ++i) {
    REQUIRE(a[i].rotation_xyzw_size() == b[i].rotation_xyzw_size());
    for (int k = 0; k < a[i].rotation_xyzw_size(); ++k) {
      worst = std::max(worst, std::abs(a[i].rotation_xyzw(k) - b[i].rotation_xyzw(k)));
    }
  }
  CHECK(worst <= 1e-5F);
}

TEST_CASE("a full disk stops the recording and not the stream, and is counted and reported") {
  Served served;
  served.daemon.emplace(std::vector<std::string>{"record", "--config", served.path("posed.toml"),
                                                 "--out", served.path("take.plog")});
  const auto line = served.daemon->line();
  INFO(served.daemon->errors());
  REQUIRE(line);
  const auto ready = json::parse(*line);
  const std::string publish = ready.at("publish"), control = ready.at("control");
  std::this_thread::sleep_for(600ms);
  const rlimit full{4096, 4096};  // limit for any file; the daemon's stderr output still fits
  REQUIRE(prlimit(served.daemon->pid(), RLIMIT_FSIZE, &full, nullptr) == 0);

  std::uint64_t errors = 0;
  for (int i = 0; i < 50 && errors == 0; ++i) {
    std::this_thread::sleep_for(200ms);
    const ProgramOutcome status = posed({"ctl", "--connect", control, "status", "--json"});
    INFO(status.err);
    REQUIRE(status.code == 0);
    const json stats = json::parse(status.out).at("status");
    errors = std::stoull(stats.value("recorderErrors", "0"));
  }
  CHECK(errors > 0);
  CHECK(has(served.daemon->errors(), "recording stopped"));
  const ProgramOutcome take = posed({"ctl", "--connect", control, "take", "start", "walk"});
  CHECK(take.code == 0);
  CHECK(has(take.out, "take 1 'walk' begins"));
  CHECK(has(take.out, "nothing can be written"));
  const ProgramOutcome seen = posed({"monitor", "--connect", publish, "--json", "--count", "30"});
  INFO(seen.err);
  CHECK(seen.code == 0);
  served.daemon->send(SIGTERM);
  CHECK(served.daemon->exit_code().value_or(-1) <= 1);  // 1: the log lacks something
}

}  // namespace posed::test
