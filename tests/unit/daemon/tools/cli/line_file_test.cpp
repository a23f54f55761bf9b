// Whatever ends the writing, the file has whole lines only.
#include "daemon/tools/live/line_file.hpp"

#include <csignal>

#include <sys/resource.h>
#include <catch2/catch.hpp>

#include "tests/support/file_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::tools {
namespace {

TEST_CASE("lines are there when they are added, and replace an old file only then") {
  const test::TempFolder folder;
  const auto path = folder.write("top.jsonl", "old\n");
  LineFile file(path, true);
  CHECK(test::file_text(path) == "old\n");
  REQUIRE(file.add("{\"a\": 1}"));
  CHECK(test::file_text(path) == "{\"a\": 1}\n");
  REQUIRE(file.add("{}"));
  CHECK(test::file_text(path) == "{\"a\": 1}\n{}\n");
}

TEST_CASE("a file that came meanwhile is kept, and no two writers share one") {
  const test::TempFolder folder;
  const auto path = folder.path() / "top.jsonl";
  LineFile late(path, false), first(path, false), second(path, true);
  REQUIRE(first.add("1"));
  for (LineFile* other : {&late, &second}) {
    const auto refused = other->add("2");
    REQUIRE_FALSE(refused);
    CHECK(refused.error().text().find("name another file") != std::string::npos);
  }
  REQUIRE(first.add("3"));
  CHECK(test::file_text(path) == "1\n3\n");
}

TEST_CASE("a line that does not fit leaves nothing of itself") {
  const test::TempFolder folder;
  const auto path = folder.path() / "top.jsonl";
  LineFile file(path, false);
  REQUIRE(file.add("0123456789"));
  rlimit before{};
  REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit full{.rlim_cur = 15, .rlim_max = before.rlim_max};
  REQUIRE(setrlimit(RLIMIT_FSIZE, &full) == 0);
  const auto done = file.add("0123456789");
  REQUIRE(setrlimit(RLIMIT_FSIZE, &before) == 0);
  std::signal(SIGXFSZ, handler);
  REQUIRE_FALSE(done);
  CHECK(done.error().text().find("free some space") != std::string::npos);
  CHECK(test::file_text(path) == "0123456789\n");
}

TEST_CASE("a file that cannot be made is named") {
  LineFile file("/nowhere/top.jsonl", false);
  const auto done = file.add("{}");
  REQUIRE_FALSE(done);
  CHECK(done.error().text().find("/nowhere/top.jsonl") != std::string::npos);
}

}  // namespace
}  // namespace posed::tools
