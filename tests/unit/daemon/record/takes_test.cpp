// Takes in the log: marked from the cold side, exact to the chunk, and never lost.
#include <catch2/catch.hpp>

#include <string>
#include <vector>

#include "tests/support/file_limit.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/daemon/record/toy_recording.hpp"

namespace posed::record {
namespace {

using test::kTurn_ns;

std::vector<log::TakeRow> takes_in(const std::filesystem::path& path) {
  const auto reader = log::Reader::open(path);
  REQUIRE(reader);
  const auto rows = reader->takes();
  REQUIRE(rows);
  return *rows;
}

struct TakesRecording {
  TakesRecording() { test::add_one_body_streams(rings, 1); }
  void chunk(std::uint64_t item) {
    const pipeline::StreamPosition place{.stream = 0, .frame = item};
    rings.chunk(0, 0, pipeline::Direction::kFromDevice, static_cast<std::int64_t>(item),
                {.item = item, .streams = std::span(&place, 1)}, test::bytes_of("x"));
  }
  Result<pipeline::Take> mark(bool start, const std::string& name = "") {
    return rings.mark_take({.start = start, .time_ns = now_ns, .name = name});
  }
  void turn() { log_writer.turn(now_ns += kTurn_ns); }
  // Long enough for a commit.
  void commit() {
    for (int i = 0; i < 6; ++i) turn();
  }

  test::TempFolder dir;
  std::filesystem::path path = dir.path() / "a.plog";
  std::int64_t now_ns = 0;
  std::vector<RecorderEvent> events;
  RecordRings rings{test::ring_sizes_of(1, 4096, {.frame_bytes = 64, .decisions = 8})};
  LogWriterLoop log_writer{rings, test::make_writer(path, 1), path,
                           [this](const RecorderEvent& event) { events.push_back(event); }};
};

}  // namespace

TEST_CASE("a take has the chunks from the newest at its beginning to the one before its end") {
  TakesRecording recording;
  recording.chunk(1);
  recording.chunk(2);
  const auto first = recording.mark(true, "walk");
  REQUIRE(first);
  CHECK(first->number == 1);
  recording.chunk(4);
  const auto second = recording.mark(true, "run");  // ends the first
  REQUIRE(second);
  CHECK(second->number == 2);
  CHECK(recording.rings.running_take()->name == "run");
  recording.chunk(7);
  const auto ended = recording.mark(false);
  REQUIRE(ended);
  CHECK(ended->number == 2);
  CHECK_FALSE(recording.rings.running_take());
  CHECK_FALSE(recording.mark(false));
  recording.turn();
  REQUIRE(recording.events.size() == 4);
  for (const RecorderEvent& event : recording.events) {
    CHECK(event.kind == RecorderEvent::Kind::kTake);
    CHECK(event.streams == std::vector<std::uint32_t>{0});
  }
  CHECK(recording.events[0].text == "take 1 'walk' begins");
  CHECK(recording.events[1].text == "take 1 'walk' has ended after 0.0 s");
  REQUIRE(recording.log_writer.finish(recording.now_ns));
  const auto rows = takes_in(recording.path);
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].first_item == 2);
  CHECK(rows[0].last_item == 3);
  CHECK(rows[1].first_item == 4);
  CHECK(rows[1].last_item == 6);
  CHECK(rows[1].name == "run");
}

TEST_CASE("a take that runs is in the log, to its end, before it has ended") {
  TakesRecording recording;
  recording.chunk(5);
  REQUIRE(recording.mark(true, "walk"));
  recording.commit();
  const auto running = takes_in(recording.path);  // what a kill would leave
  REQUIRE(running.size() == 1);
  CHECK(running[0].first_item == 5);
  CHECK(running[0].last_item == log::kToTheEnd);
  recording.chunk(9);
  REQUIRE(recording.mark(false));
  recording.commit();
  const auto ended = takes_in(recording.path);
  REQUIRE(ended.size() == 1);
  CHECK(ended[0].last_item == 8);
}

TEST_CASE("a full disk costs no take, and who marks a take is told of it") {
  TakesRecording recording;
  std::uint64_t item = 1;
  for (; item < 20; ++item) recording.chunk(item);
  recording.commit();
  recording.chunk(item);
  const auto walk = recording.mark(true, "walk");
  REQUIRE(walk);
  CHECK(walk->trouble.empty());
  {
    const test::FileLimit full(4096);
    for (; item < 200; ++item) {
      recording.chunk(item + 1);
      recording.turn();
    }
    CHECK(recording.log_writer.errors() > 0);
    const auto running = recording.rings.running_take();
    REQUIRE(running);
    CHECK(running->lost_chunks > 50);
    CHECK(running->lost_chunks == recording.log_writer.lost_chunks());
    CHECK(running->trouble.contains(recording.path.string()));
  }
  recording.now_ns += 100 * kNanosPerSecond;  // the next try
  recording.turn();
  const auto ended = recording.mark(false);
  REQUIRE(ended);
  CHECK(ended->trouble.empty());  // the disk has room again
  CHECK(ended->lost_chunks > 50);
  const auto after = recording.mark(true);
  REQUIRE(after);
  CHECK(after->lost_chunks == 0);
  REQUIRE(recording.mark(false));
  recording.turn();
  CHECK(recording.events.back().text == "take 2 has ended after 0.0 s");
  CHECK(recording.events[recording.events.size() - 3].text.contains("; meanwhile the log lost "));
  REQUIRE(recording.log_writer.finish(recording.now_ns));
  const auto rows = takes_in(recording.path);
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].first_item == 20);
  CHECK(rows[0].last_item == 199);
}

TEST_CASE("a recording has a limited number of takes") {
  Takes takes;
  for (std::uint32_t i = 0; i < kMaxTakes; ++i) REQUIRE(takes.mark({}, 1));
  CHECK_FALSE(takes.mark({}, 1));
  CHECK(takes.running()->number == kMaxTakes);
  CHECK(takes.mark({.start = false}, 1));
}

}  // namespace posed::record
