// `posed replay --expect` of several logs: one line a log in their order, as each alone says.
#include <catch2/catch.hpp>

#include <chrono>
#include <filesystem>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>
#include <pugixml.hpp>

#include "tests/e2e/outcome.hpp"
#include "tests/support/has.hpp"
#include "tests/support/log_surgery.hpp"
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
    for (const auto& [name, log] : {std::pair("staged.plog", "replay/staged.plog"),
                                    {"feet.plog", "replay/feet.plog"},
                                    {"staged-again.plog", "replay/staged.plog"}}) {
      good.push_back((folder.path() / name).string());
      std::filesystem::copy_file(golden(log), good.back());
    }
  }
};

std::vector<json> lines_of(const ProgramOutcome& outcome) {
  std::istringstream text(outcome.out);
  std::vector<json> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(json::parse(line));
  return lines;
}

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
  const std::vector<json> found = lines_of(all);
  REQUIRE(found.size() == kept.good.size());
  for (std::size_t i = 0; i < kept.good.size(); ++i) {
    CHECK(found[i]["log"] == kept.good[i]);
    CHECK(found[i]["same"] == !alone[i].is_null());
    if (alone[i].is_null()) continue;
    CHECK(found[i]["frames"] == alone[i]["frames"]);
    CHECK(found[i]["compared"] == alone[i]["compared"]);
    for (const auto& [key, value] : alone[i].items()) CHECK(found[i].contains(key));
    CHECK(found[i].size() == alone[i].size());
  }
}

TEST_CASE("a log that cannot be replayed fails the farm, the others are compared", "[farm]") {
  const KeptLogs kept;
  const auto done = farm({kept.good[0], kept.bad, kept.good[1]}, {"--expect", "--json"});
  CHECK(done.code == 1);
  const std::vector<json> found = lines_of(done);
  REQUIRE(found.size() == 3);
  CHECK(found[1]["same"] == false);
  CHECK(has(found[1]["problem"].get<std::string>(), "bad.plog"));
  CHECK(found[0]["frames"] > 0);
  CHECK(found[2]["frames"] > 0);
  CHECK(has(done.err, "of 3 logs"));
}

TEST_CASE("each log is replayed on its own instruction set, or all on one", "[farm]") {
  const KeptLogs kept;
  const std::vector<std::string> recorded{"portable", "avx2", "portable"};
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    run_sql(kept.good[i], "UPDATE meta SET value='" + recorded[i] + "' WHERE key='isa'");
  }
  const auto check_as_alone = [&](std::vector<std::string> more) {
    more.insert(more.end(), {"--expect", "--json"});
    const std::vector<json> found = lines_of(farm(kept.good, more));
    REQUIRE(found.size() == kept.good.size());
    for (std::size_t i = 0; i < kept.good.size(); ++i) {
      const auto alone = farm({kept.good[i], "--speed", "max"}, more);
      CHECK(found[i]["same"] == (alone.code == 0));
      if (alone.code != 0) continue;  // the last bits may differ
      const json counts = json::parse(alone.out);
      CHECK(found[i]["isa"] == counts["isa"]);
      CHECK(found[i]["compared"] == counts["compared"]);
    }
    return found;
  };
  const auto own = check_as_alone({});
  CHECK(own[0]["isa"] == "portable");
  CHECK(own[2]["isa"] == "portable");
  if (own[1]["isa"] != "avx2") WARN("this CPU has no AVX2");
  for (const json& line : check_as_alone({"--isa", "portable"})) CHECK(line["isa"] == "portable");
  const auto reported = farm(kept.good, {"--expect", "--isa", "portable"});
  CHECK(has(reported.out, "avx2 ... portable ... last bits"));
}

TEST_CASE("what the logs lack is told, and nothing compared is a failure", "[farm]") {
  const KeptLogs kept;
  const std::string& nothing = kept.good[1];
  const std::string& last = kept.good[2];
  forge(nothing, "INSERT INTO gap VALUES(1, 1, 0, 0, 5, 0, 0)");  // all decisions are lost
  forge(last,
        "INSERT INTO gap VALUES(1, 2, 0, 0, 2, 0, 0); DELETE FROM frame WHERE id IN "
        "(SELECT id FROM frame WHERE stream=0 AND raw=0 ORDER BY id DESC LIMIT 2)");
  const std::string none = nothing + ": nothing could be compared: 0 frames that the log lacks, ";
  const auto alone = farm({nothing}, {"--expect", "--speed", "max"});
  CHECK(alone.code == 1);
  CHECK(has(alone.err, none));
  const auto lacks = farm({last, last}, {"--expect"});
  if (lacks.code == 0) {  // the last bits may differ
    CHECK(has(lacks.out, "not compared: 2 ... 0 after a gap, 0 past"));
    CHECK(has(lacks.err, "bit for bit ... not compared: 4 ... 0 after"));
  }
  CHECK(has(lacks.err, last + ": stream a: ... 2 published frames ... chunk 0"));

  const auto done = farm(kept.good, {"--expect"});
  CHECK(done.code == 1);
  CHECK(has(done.out, none));
  const auto found = lines_of(farm(kept.good, {"--expect", "--json"}));
  REQUIRE(found.size() == 3);
  CHECK(found[0].at("missing").empty());
  CHECK(found[1]["same"] == false);
  CHECK(found[1]["compared"] == 0);
  CHECK(has(found[1].at("missing").dump(), "5 decisions ... chunk 0"));
}

TEST_CASE("a JUnit report has a case for each log, failed where it differs", "[farm]") {
  const KeptLogs kept;
  const std::string path = (kept.folder.path() / "replay.xml").string();
  const auto done = farm({kept.good[0], kept.bad}, {"--expect", "--json", "--junit", path});
  CHECK(done.code == 1);
  pugi::xml_document document;
  REQUIRE(document.load_file(path.c_str()));
  const auto suite = document.child("testsuites").child("testsuite");
  const std::vector<json> found = lines_of(done);
  REQUIRE(found.size() == 2);
  const int failed = found[0]["same"] == true ? 1 : 2;  // the last bits may differ on this CPU
  CHECK(suite.attribute("tests").as_int() == 2);
  CHECK(suite.attribute("failures").as_int() == failed);
  const auto good = suite.child("testcase");
  CHECK(std::string(good.attribute("name").value()) == kept.good[0]);
  CHECK((good.child("failure").empty()) == (failed == 1));
  const auto bad = good.next_sibling("testcase");
  CHECK(std::string(bad.attribute("name").value()) == kept.bad);
  CHECK(has(bad.child("failure").attribute("message").value(), "bad.plog"));
  CHECK(farm({kept.good[0]}, {"--expect", "--junit", path}).code == 2);  // there is one already
}

TEST_CASE("Ctrl-C ends the farm, which says that not all was compared", "[farm]") {
  const KeptLogs kept;
  std::vector<std::string> arguments{"replay", "--expect", "--json"};
  for (int i = 0; i < 4000; ++i) arguments.push_back(kept.good[static_cast<std::size_t>(i) % 3]);
  Process farm(std::move(arguments));
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (!has(farm.errors(), " of 4000 logs") && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  farm.send(SIGINT);
  CHECK(farm.rest().empty());
  CHECK(farm.exit_code() == 1);
  CHECK(has(farm.errors(), "interrupted"));
}

TEST_CASE("options that make no sense for several logs are refused", "[farm]") {
  const KeptLogs kept;
  const auto refused = [&](std::vector<std::string> more, const std::string& why) {
    const auto done = farm(kept.good, std::move(more));
    return done.code == 2 && has(done.err, why);
  };
  CHECK(refused({}, "add --expect"));
  CHECK(refused({"--expect", "--publish"}, "leave out --publish and --out"));
  CHECK(refused({"--expect", "--out", "x.bin"}, "leave out --publish and --out"));
  CHECK(refused({"--expect", "--junit", kept.good[0]}, ".xml"));
  CHECK(refused({"--expect", "--speed", "2"}, "leave out --speed"));
}

}  // namespace posed::test
