#include "daemon/logging/journal.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>

#include <spdlog/common.h>
#include <catch2/catch.hpp>

#include "daemon/logging/line_limiter.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::logging {
namespace {

bool has_field(const std::vector<std::string>& fields, const std::string& field) {
  return std::ranges::find(fields, field) != fields.end();
}

}  // namespace

TEST_CASE("a line for the journal has the stream, the cause and the count as fields") {
  const std::string text = "walker: 17 frames came too late (the last of 12 like it)";
  const auto fields =
      journal_fields(spdlog::level::warn, text, cause_of("walker: 17 frames came too late"), 12);
  CHECK(has_field(fields, "MESSAGE=" + text));
  CHECK(has_field(fields, "PRIORITY=4"));
  CHECK(has_field(fields, "SYSLOG_IDENTIFIER=posed"));
  CHECK(has_field(fields, "POSED_STREAM=walker"));
  CHECK(has_field(fields, "POSED_CAUSE=walker: # frames came too late"));
  CHECK(has_field(fields, "POSED_COUNT=12"));
}

TEST_CASE("a line without a word before its first colon has no field for a stream") {
  for (const char* text : {"no real-time rights", "", ": x", "a b: c", "http://x"}) {
    INFO(text);
    const auto fields = journal_fields(spdlog::level::err, text, text, 1);
    CHECK(has_field(fields, "PRIORITY=3"));
    CHECK(std::ranges::none_of(
        fields, [](const std::string& field) { return field.starts_with("POSED_STREAM="); }));
  }
}

TEST_CASE("the journal is there only if JOURNAL_STREAM is what stderr is") {
  const test::TempFolder folder;
  std::FILE* file = std::fopen((folder.path() / "log").c_str(), "w");
  REQUIRE(file != nullptr);
  struct stat info{};
  REQUIRE(::fstat(::fileno(file), &info) == 0);
  ::unsetenv("JOURNAL_STREAM");
  CHECK_FALSE(is_journal(::fileno(file)));
  ::setenv("JOURNAL_STREAM", "8:1234567", 1);
  CHECK_FALSE(is_journal(::fileno(file)));
  const std::string own = std::to_string(info.st_dev) + ":" + std::to_string(info.st_ino);
  ::setenv("JOURNAL_STREAM", own.c_str(), 1);
  CHECK(is_journal(::fileno(file)));
  ::unsetenv("JOURNAL_STREAM");
  std::fclose(file);
}

}  // namespace posed::logging
