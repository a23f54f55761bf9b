// `posed replay --expect` of several logs: one line a log in their order, as each alone says.
#include <catch2/catch.hpp>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/e2e/outcome.hpp"
#include "tests/support/has.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {
namespace {

using nlohmann::json;

// Copies of the golden logs, because opening a log modifies it, and a file that is none.
struct KeptLogs {
  TempFolder folder;
  std::vector<std::string> good;
  std::string bad = folder.write("bad.plog", "no log").string();

  KeptLogs() {
    for (const char* name : {"staged.plog", "feet.plog", "staged-3.plog"}) {
      good.push_back((folder.path() / name).string());
      std::filesystem::copy_file(golden(std::string("replay/") + name), good.back());
    }
  }
};

ProgramOutcome farm(const std::vector<std::string>& logs, std::vector<std::string> more) {
  more.insert(more.begin(), logs.begin(), logs.end());
  more.insert(more.begin(), "replay");
  return posed(std::move(more));
}

}  // namespace

TEST_CASE("several logs are compared at once, each as it is alone", "[farm]") {
  const KeptLogs kept;
  bool all_same = true;
  std::vector<json> alone;
  for (const std::string& log : kept.good) {
    // The last bits of a golden log may differ on other CPUs.
    const auto one = farm({log}, {"--speed", "max", "--expect", "--json"});
    all_same = all_same && one.code == 0;
    alone.push_back(one.code == 0 ? json::parse(one.out) : json());
  }
  const auto all = farm(kept.good, {"--expect", "--json"});
  INFO(all.err);
  CHECK(all.code == (all_same ? 0 : 1));
  std::istringstream lines(all.out);
  std::string line;
  for (std::size_t i = 0; i < kept.good.size(); ++i) {
    REQUIRE(std::getline(lines, line));
    const json found = json::parse(line);
    CHECK(found["log"] == kept.good[i]);
    CHECK(found["same"] == !alone[i].is_null());
    if (alone[i].is_null()) continue;
    CHECK(found["frames"] == alone[i]["frames"]);
    CHECK(found["compared"] == alone[i]["compared"]);
  }
  CHECK_FALSE(std::getline(lines, line));
}

TEST_CASE("a log that cannot be replayed fails the farm, the others are compared", "[farm]") {
  const KeptLogs kept;
  const auto done = farm({kept.good[0], kept.bad, kept.good[1]}, {"--expect", "--json"});
  CHECK(done.code == 1);
  std::istringstream lines(done.out);
  std::vector<json> found;
  for (std::string line; std::getline(lines, line);) found.push_back(json::parse(line));
  REQUIRE(found.size() == 3);
  CHECK(found[1]["same"] == false);
  CHECK(has(found[1]["problem"].get<std::string>(), "bad.plog"));
  CHECK(found[0]["frames"] > 0);
  CHECK(found[2]["frames"] > 0);
  CHECK(has(done.err, "of 3 logs do not give what was published"));
}

TEST_CASE("options that make no sense for several logs are refused", "[farm]") {
  const KeptLogs kept;
  const auto refused = [&](std::vector<std::string> more, const std::string& why) {
    const auto done = farm(kept.good, std::move(more));
    return done.code == 2 && has(done.err, why);
  };
  CHECK(refused({}, "add --expect"));
  CHECK(refused({"--expect", "--publish"}, "for one log"));
  CHECK(refused({"--expect", "--out", "x.bin"}, "for one log"));
  CHECK(refused({"--expect", "--speed", "2"}, "leave out --speed"));
}

}  // namespace posed::test
