// The recorder: what is lost while streams come and go.
#include <catch2/catch.hpp>

#include <atomic>
#include <map>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "models/style/live/style_type.hpp"
#include "proto/log/digest.hpp"
#include "tests/support/file_limit.hpp"
#include "tests/unit/daemon/record/toy_recording.hpp"

using namespace posed;
using namespace posed::record;
using namespace posed::test;
using pipeline::stream_id;
using pipeline::StreamPosition;

TEST_CASE("losses belong to the generation of a slot that had them, however many there were") {
  BodiesRecording loop(many_bodies(65536, 1, {.frame_bytes = 400, .decisions = 1}));
  const std::vector<std::uint32_t> ids{stream_id(0, 1), stream_id(0, 2), stream_id(0, 3)};
  const std::string frame(300, 'f');
  // The recorder sleeps. Each generation has four frames; one record of the first fits.
  std::uint64_t next = 1;
  for (const std::uint32_t id : ids) {
    loop.rings.add_stream(body_stream(id, "Ann"));
    for (int i = 0; i < 4; ++i, ++next) {
      put_bodies(loop.rings, next, {{id, next, 1}}, bytes_of("c"));
      loop.rings.decision({.stream = id, .item = next, .sequence = next});
      loop.rings.published(id, next, false, bytes_of(frame));
    }
    loop.rings.unpublished(id);
  }
  loop.turn();
  // Of the last one only: a record that fits carries what it lost itself.
  put_bodies(loop.rings, next, {{ids[2], next, 1}}, bytes_of("c"));
  loop.rings.decision({.stream = ids[2], .item = next, .sequence = next});
  loop.rings.published(ids[2], next, false, bytes_of(frame));
  loop.finish();
  const auto rows = gaps(loop.path);
  CHECK(rows.size() == 6);
  const std::vector<std::uint64_t> decisions{3, 4, 4}, frames{4, 5, 5};
  for (std::size_t i = 0; i < ids.size(); ++i) {
    CHECK(lost(rows, ids[i], GapKind::kDecisions) == decisions[i]);
    CHECK(lost(rows, ids[i], GapKind::kFrames) == frames[i]);
  }
  // The gap of decisions begins before the chunk of the first frame that they concern.
  const std::map<std::uint32_t, std::int64_t> after{{ids[0], 1}, {ids[1], 4}, {ids[2], 8}};
  for (const log::GapRow& row : rows) {
    if (row.kind == GapKind::kDecisions) CHECK(row.after_chunk == after.at(row.owner));
  }
  const auto reader = log::Reader::open(loop.path);
  REQUIRE(reader);
  CHECK(ids_of(*reader) ==
        ids);  // also the one that the log has nothing of but its chunks and gaps
}

TEST_CASE("while generations follow each other every record is in the log or counted") {
  BodiesRecording loop(many_bodies(65536, 1, {.frame_bytes = 2000, .decisions = 8}));
  constexpr std::uint32_t kGenerations = 300;
  constexpr std::uint64_t kOfEach = 20;
  std::atomic<std::uint32_t> reached{0};  // the generation whose frames are published
  std::atomic<bool> running{true};
  std::thread pipeline([&] {
    for (std::uint32_t generation = 1; generation <= kGenerations; ++generation) {
      const std::uint32_t id = stream_id(0, generation);
      loop.rings.add_stream(body_stream(id, "Ann"));
      reached = generation;
      for (std::uint64_t i = 1; i <= kOfEach; ++i) {
        loop.rings.decision({.stream = id, .item = i, .sequence = i});
      }
      loop.rings.unpublished(id);
    }
  });
  std::thread publisher([&] {
    for (std::uint32_t generation = 1; generation <= kGenerations; ++generation) {
      while (reached < generation) std::this_thread::yield();
      for (std::uint64_t i = 1; i <= kOfEach; ++i) {
        loop.rings.published(stream_id(0, generation), i, false, bytes_of("frame"));
      }
    }
    running = false;
  });
  while (running) loop.turn();
  pipeline.join();
  publisher.join();
  loop.finish();
  const auto reader = log::Reader::open(loop.path);
  REQUIRE(reader);
  CHECK(reader->streams().size() == kGenerations);
  const auto decisions = reader->decisions();
  REQUIRE(decisions);
  std::map<std::uint32_t, std::uint64_t> kept;
  for (const log::DecisionRow& row : *decisions) ++kept[row.stream];
  const auto rows = gaps(loop.path);
  for (const log::StreamRow& stream : reader->streams()) {
    std::uint64_t frames = 0;
    auto logged = reader->frames(stream.id, false);
    REQUIRE(logged);
    for (auto row = logged->next(); row && row->has_value(); row = logged->next()) ++frames;
    REQUIRE(kept[stream.id] + lost(rows, stream.id, GapKind::kDecisions) == kOfEach);
    REQUIRE(frames + lost(rows, stream.id, GapKind::kFrames) == kOfEach + 1);
  }
}

TEST_CASE("rows of streams that came while the disk was full are in the log later") {
  BodiesRecording loop(many_bodies(1 << 20, 2, {.frame_bytes = 0, .decisions = 64}));
  const std::uint32_t before = stream_id(0, 0), within = stream_id(1, 0), next = stream_id(0, 1);
  const std::string line(20'000, '1');
  std::uint64_t item = 0;
  const auto turns = [&](int count, const std::vector<std::uint32_t>& ids) {
    for (int i = 0; i < count; ++i) {
      ++item;
      std::vector<StreamPosition> places;
      for (const std::uint32_t id : ids) places.push_back({id, item, 1});
      put_bodies(loop.rings, item, places, bytes_of(line));
      for (const std::uint32_t id : ids) {
        loop.rings.decision({.stream = id, .item = item, .sequence = item});
      }
      loop.turn();
    }
  };
  loop.rings.add_stream(body_stream(before, "Ann"));
  RecordedStream bob = body_stream(within, "Bob");
  bob.settings.stages.push_back(pipeline::stage_settings(style::style_type()));
  bob.model_files = {std::make_shared<const std::string>("model")};
  std::optional<FileLimit> limit(200'000);
  SECTION("the disk was full before the first commit") { limit.emplace(1000); }
  SECTION("the disk was full later") {}
  turns(10, {before});
  loop.rings.add_stream(bob);
  turns(40, {before, within});
  loop.rings.add_stream(body_stream(next, "Ann"));
  turns(40, {within, next});
  CHECK(loop.log_writer.errors() >= 1);
  REQUIRE(!loop.events.empty());
  CHECK(loop.events.front().kind == RecorderEvent::Kind::kError);
  CHECK(loop.events.front().streams.front() == before);
  limit.reset();
  turns(400, {next});
  CHECK(loop.events.back().kind == RecorderEvent::Kind::kGap);
  loop.finish();
  const auto reader = log::Reader::open(loop.path);
  REQUIRE(reader);
  CHECK(ids_of(*reader) == std::vector{before, within, next});
  CHECK(reader->streams()[1].first_item == 11);
  CHECK(reader->streams()[2].first_item == 51);
  CHECK(reader->blob(log::sha256_hex(bytes_of(*bob.model_files[0]))));
  const auto rows = gaps(loop.path);
  std::map<std::uint32_t, std::uint64_t> kept;
  const auto decisions = reader->decisions();
  REQUIRE(decisions);
  for (const log::DecisionRow& row : *decisions) ++kept[row.stream];
  CHECK(kept[before] + lost(rows, before, GapKind::kDecisions) == 50);
  CHECK(kept[within] + lost(rows, within, GapKind::kDecisions) == 80);
  CHECK(kept[next] + lost(rows, next, GapKind::kDecisions) == 440);
  CHECK(lost(rows, within, GapKind::kDecisions) > 50);
}
