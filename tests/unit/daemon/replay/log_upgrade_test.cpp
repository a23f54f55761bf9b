#include "daemon/replay/log_upgrade.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include "proto/log/reader.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/log_surgery.hpp"
#include "tests/support/replayed.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::replay {
namespace {

const auto kNeverStop = [] { return false; };

// A copy, because opening a log may write to it.
std::filesystem::path copy_of_golden(const test::TempFolder& folder, const char* name) {
  const auto copy = folder.path() / name;
  std::filesystem::copy_file(test::golden(std::string("replay/") + name), copy);
  return copy;
}

// What format 3 numbers: per chunk its first item and the numbers of its stream, per decision its
// item.
std::vector<std::string> numbers_of(const std::filesystem::path& path) {
  auto reader = log::Reader::open(path).value();
  std::vector<std::string> numbers;
  while (const auto chunk = reader.next_chunk().value()) {
    const log::StreamPosition& place = chunk->places[0];
    numbers.push_back("chunk " + std::to_string(chunk->first_item) + " stream " +
                      std::to_string(place.stream) + " frame " + std::to_string(place.next_frame) +
                      " sample " + std::to_string(place.next_sample));
  }
  const auto decisions = reader.decisions().value();
  for (const log::DecisionRow& row : decisions) {
    // staged-3.plog was not ended, and has a shed after the frames that it names; an older format
    // has it at the first of them. Replay needs only the frames.
    if (row.name == log::words::kEnd || row.name == log::words::kShed) continue;
    numbers.push_back("decision " + std::to_string(row.item) + " " + row.stage + "/" + row.name);
  }
  for (const log::StreamRow& row : reader.streams()) {
    numbers.push_back("stream " + std::to_string(row.first_item) + row.stages_json);
  }
  return numbers;
}

}  // namespace

TEST_CASE("a log of format 1 becomes the same run in format 3") {
  const test::TempFolder folder;
  const auto old = copy_of_golden(folder, "staged.plog");
  const auto upgraded = folder.path() / "new.plog";
  const auto summary = upgrade_log(old, upgraded, kNeverStop);
  INFO((summary ? "" : summary.error().text()));
  REQUIRE(summary);
  CHECK(summary->chunks == 93);
  CHECK(numbers_of(upgraded) == numbers_of(copy_of_golden(folder, "staged-3.plog")));
  CHECK(log::Reader::open(upgraded)->counts_items());
  CHECK(log::Reader::open(upgraded)->meta() == log::Reader::open(old)->meta());

  const test::Replayed before = test::replayed(old), after = test::replayed(upgraded);
  CHECK(before.frames.size() > 100);
  CHECK(after.frames == before.frames);
  CHECK(after.counts.compared == before.counts.compared);

  const auto again = upgrade_log(upgraded, folder.path() / "again.plog", kNeverStop);
  REQUIRE_FALSE(again);
  CHECK(again.error().text().contains("nothing to upgrade"));
}

TEST_CASE("an upgrade that fails or is interrupted leaves the files as they were") {
  const test::TempFolder folder;
  const auto old = copy_of_golden(folder, "staged.plog");
  const auto out = folder.write("out.plog", "mine");
  int chunks = 0;
  const auto stopped = upgrade_log(old, out, [&] { return ++chunks > 20; });
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().text().contains("interrupted"));
  test::run_sql(old, "DELETE FROM blob");
  const auto damaged = upgrade_log(old, out, kNeverStop);
  REQUIRE_FALSE(damaged);
  CHECK(test::file_text(out) == "mine");
  create_directory(folder.path() / "taken.plog");
  const auto whole = folder.path() / "whole.plog";
  std::filesystem::copy_file(test::golden("replay/staged.plog"), whole);
  CHECK_FALSE(upgrade_log(whole, folder.path() / "taken.plog", kNeverStop));
  remove(whole);
  remove(folder.path() / "taken.plog");
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
    CHECK((entry.path() == old || entry.path() == out));
  }
}

TEST_CASE("a gap of an old log is in the new one, after the same chunk") {
  const test::TempFolder folder;
  const auto old = copy_of_golden(folder, "staged.plog");
  test::run_sql(old,
                "DELETE FROM chunk WHERE id IN (11, 12, 13);"
                "INSERT INTO gap(stream,kind,after_chunk,lost,time_ns) VALUES(0,0,10,3,0)");
  const auto upgraded = folder.path() / "new.plog";
  REQUIRE(upgrade_log(old, upgraded, kNeverStop));
  const auto gaps = log::Reader::open(upgraded)->gaps();
  REQUIRE((gaps && gaps->size() == 1));
  CHECK(gaps->front().after_chunk == 10);
  CHECK(gaps->front().lost == 3);
  CHECK(test::replayed(upgraded).frames == test::replayed(old).frames);
}

}  // namespace posed::replay
