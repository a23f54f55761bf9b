// Every device's recorded log gives the expected output stored beside it.
#include "tests/unit/drivers/recorded_log.hpp"

#include <catch2/catch.hpp>

#include <cstdlib>
#include <set>

#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {

TEST_CASE("recorded device logs decode to the expected output beside them") {
  // For an intended change, UPDATE_EXPECTED=1 unit_drivers rewrites the expected output where it
  // differs; state the reason in the commit.
  const bool update = std::getenv("UPDATE_EXPECTED") != nullptr;
  std::set<std::string> seen;
  for (const auto& entry : std::filesystem::directory_iterator(golden("devices"))) {
    if (entry.path().extension() != ".log") continue;
    INFO(entry.path().filename());
    auto expected_path = entry.path();
    expected_path.replace_extension(".chk");
    const RecordedLog log = read_recorded_log(entry.path());
    seen.insert(log.driver);
    const std::string got = decoded_lines(log);
    if (update) update_expected(expected_path, got);
    CHECK(first_difference(got, expected_lines(expected_path)) == "");
  }
  for (const drivers::Driver& driver : drivers::registry()) {
    INFO(driver.name << " has no recorded log");
    CHECK(seen.contains(std::string(driver.name)));
  }
}

TEST_CASE("a difference in a recorded log's output is reported by line") {
  CHECK(first_difference("a 1.0\nb 2", "a 1.000001\nb 2").empty());
  CHECK(first_difference("a 1\nb 2", "a 1\nb 2.1") == "line 2: got 'b 2', expected 'b 2.1'");
  CHECK(first_difference("a 1", "a 1\nb 2") == "line 2: got 'the end', expected 'b 2'");
  CHECK(first_difference("a 1 2", "a 1") == "line 1: got 'a 1 2', expected 'a 1'");
}

TEST_CASE("expected output is rewritten only where it differs") {
  const TempFolder folder;
  const auto path = folder.path() / "glove.chk";
  update_expected(path, "a 1\nb 0\n");
  CHECK(expected_lines(path) == "a 1\nb 0\n");
  update_expected(path, "a 1.000001\nb -0\n");
  CHECK(expected_lines(path) == "a 1\nb 0\n");
  update_expected(path, "a 1.1\nb 0\n");
  CHECK(expected_lines(path) == "a 1.1\nb 0\n");
}

}  // namespace posed::test
