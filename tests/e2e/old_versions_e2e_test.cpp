// Files that released versions wrote. Each folder of tests/golden/versions is a version's: a style
// model, a gesture model, a log of a walker and a hand that use them, with frames, and the schema
// of the wire. They are never written again; a release adds its own.
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/e2e/outcome.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/log_surgery.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

const char* const kFiles[] = {"walk.style", "hand.gesture", "take.plog"};

// Copies, because opening a log may write to it.
void copy_version(const std::filesystem::path& version, const TempFolder& folder) {
  for (const char* file : kFiles) {
    std::filesystem::copy_file(version / file, folder.path() / file,
                               std::filesystem::copy_options::overwrite_existing);
  }
}

}  // namespace

TEST_CASE("models and logs of every released version open in this one", "[versions]") {
  int versions = 0;
  for (const auto& version : std::filesystem::directory_iterator(golden("versions"))) {
    INFO(version.path().string());
    const TempFolder folder;
    const auto path = [&](const char* name) { return (folder.path() / name).string(); };
    copy_version(version.path(), folder);
    const auto check = [](const std::vector<std::string>& words) {
      const ProgramOutcome outcome = posed(words);
      INFO(words[0] << ": " << outcome.err);
      CHECK(outcome.code == 0);
    };
    check({"replay", path("take.plog"), "--speed", "max"});
    check({"convert", path("take.plog"), "--stream", "walker-raw", "--out", path("walk.bvh")});
    check({"apply", "--model", path("walk.style"), path("walk.bvh"), "--out", path("styled.bvh")});
    CHECK(file_text(path("styled.bvh")) != file_text(path("walk.bvh")));
    check(
        {"synth", "--model", path("hand.gesture"), "--labels", "g 1 c", "--out", path("hand.csv")});
    ++versions;
  }
  CHECK(versions > 0);
}

TEST_CASE("models and logs of a newer version are refused with a sentence", "[versions]") {
  const TempFolder folder;
  const auto path = [&](const char* name) { return (folder.path() / name).string(); };
  copy_version(golden("versions/0.1.0"), folder);
  for (const char* model : {"walk.style", "hand.gesture"}) {
    std::fstream file(path(model), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(8);  // the version, behind the eight letters of the format
    file.put(99);
  }
  run_sql(folder.path() / "take.plog", "PRAGMA user_version=99");
  const auto check = [](const std::vector<std::string>& words) {
    const ProgramOutcome outcome = posed(words);
    INFO(outcome.err);
    CHECK(outcome.code == 1);
    CHECK(outcome.err.contains("99"));
    CHECK(outcome.err.contains("update posed"));
  };
  std::filesystem::copy_file(golden("versions/0.1.0/take.plog"), path("good.plog"));
  REQUIRE(posed({"convert", path("good.plog"), "--stream", "walker-raw", "--out", path("walk.bvh")})
              .code == 0);
  check({"apply", "--model", path("walk.style"), path("walk.bvh"), "--out", path("styled.bvh")});
  check({"synth", "--model", path("hand.gesture"), "--labels", "g 1 c", "--out", path("hand.csv")});
  check({"replay", path("take.plog")});
  check({"convert", path("take.plog"), "--out", path("all.mcap")});
}

}  // namespace posed::test
