// Commands in a system that gives them too little: few files, memory, stack, room on the disk. Each
// does its work or says in words why it cannot, and no signal ends it.
#include <catch2/catch.hpp>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/e2e/served.hpp"

namespace posed::test {
namespace {

// As `posed` with these arguments in a shell after `limit`.
ProgramOutcome limited(const std::string& limit, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(),
                   {"/bin/sh", "-c", limit + "; exec \"$0\" \"$@\"", posed_binary().string()});
  Process process{Command(std::move(arguments))};
  const std::string out = process.rest();
  const auto code = process.exit_code();
  REQUIRE(code);  // it ends
  return {*code, out, process.errors()};
}

// Returns the code. The shell's and the loader's own codes begin at 126, those of signals at 128.
int check_in_words(const std::string& limit, const std::vector<std::string>& arguments) {
  const ProgramOutcome outcome = limited(limit, arguments);
  INFO(limit << ": posed " << arguments[0] << ": " << outcome.code << ", " << outcome.err);
  CHECK(outcome.code < 126);
  CHECK_FALSE(has(outcome.err, "terminate called"));
  if (outcome.code == 0) return 0;
  CHECK(has(outcome.err, "posed: "));
  CHECK(outcome.err.size() < 1000);
  return outcome.code;
}

}  // namespace

TEST_CASE("a command that gets too little of the system says so, and no signal ends it") {
  Served stage;
  stage.record();
  stage.await_frames("walker", 60);
  stage.daemon->send(SIGTERM);
  REQUIRE(stage.daemon->exit_code() == 0);
  const auto path = [&](const char* name) { return stage.path(name); };
  const std::string config = path("posed.toml"), log = path("take.plog"), walk = path("walk.bvh");
  const std::vector<std::vector<std::string>> commands{
      {"check", "--config", config},
      {"record", "--config", config, "--out", path("new.plog"), "--overwrite", "--seconds", "0.1"},
      {"replay", log, "--speed", "max", "--out", path("frames.bin"), "--overwrite"},
      {"convert", log, "--stream", "walker", "--out", path("out.glb"), "--overwrite"},
      {"apply", "--model", path("one.style"), walk, "--out", path("out.bvh"), "--overwrite"},
      {"inspect", walk},
      {"render", walk, "--out", path("out.svg"), "--overwrite"},
      {"models", stage.folder.path().string()},
      {"devices"},
      {"keygen", "bob", "--out", path("keys")},
      {"emulate", "lucidgloves", "--seconds", "0.1"}};
  for (const std::string limit :
       {"true", "ulimit -n 16", "ulimit -n 6", "ulimit -v 64000", "ulimit -v 250000",
        "ulimit -s 64", "ulimit -f 1", "exec >/dev/full"}) {
    for (const auto& command : commands) {
      std::filesystem::remove_all(path("keys"));
      INFO(command[0]);
      const int code = check_in_words(limit, command);
      if (limit == "true") CHECK(code == 0);  // so the limit is what the others lack
    }
  }
  // What was there before is whole.
  CHECK(posed({"replay", log, "--speed", "max", "--expect"}).code == 0);
}

TEST_CASE("output that is lost is told, also by a command that fails") {
  const ProgramOutcome outcome = limited("exec >/dev/full", {"doctor"});
  CHECK(outcome.code != 0);
  CHECK(has(outcome.err, "the output cannot be written to stdout"));
}

}  // namespace posed::test
