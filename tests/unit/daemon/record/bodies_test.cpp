// The recorder: sources with several bodies, and streams that come late.
#include <catch2/catch.hpp>

#include <algorithm>
#include <chrono>
#include <string>
#include <vector>

#include "daemon/pipeline/description_row.hpp"
#include "models/style/live/style_type.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/daemon/record/toy_recording.hpp"

using namespace posed;
using namespace posed::record;
using namespace posed::test;
using pipeline::Direction;
using pipeline::stream_id;
using pipeline::StreamPosition;

TEST_CASE("two bodies of a source are recorded with their places and the row that lists them") {
  const TempFolder dir;
  RecorderOptions options;
  options.file = dir.path() / "a.plog";
  options.frames = true;
  options.clock = []() noexcept -> std::int64_t {
    return std::chrono::steady_clock::now().time_since_epoch().count();
  };
  const RecordedSetup setup{
      .sources = {{.row = toy_source("glove", 0)},
                  {.row = toy_source("mocap", 1), .rate_hz = 120.0, .bodies = 8}},
      .slots = 9};
  auto recorder = Recorder::open(options, setup);
  REQUIRE(recorder);
  (*recorder)->add_stream({.id = 0, .source = 0, .from_start = true, .name = "glove"});
  const std::uint32_t ann = stream_id(1, 1), bob = stream_id(2, 1);
  RecordedStream stream{.id = ann, .source = 1, .body = "Ann", .name = "mocap-ann"};
  stream.settings.stages.push_back(pipeline::stage_settings(style::style_type()));
  stream.model_files = {std::make_shared<const std::string>("model")};
  (*recorder)->add_stream(stream);
  (*recorder)->add_stream({.id = bob, .source = 1, .body = "Bob", .name = "mocap-bob"});
  (*recorder)->add_stream({.id = stream_id(3, 1), .source = 1, .body = "nobody", .name = "none"});
  auto& sink = (*recorder)->record_sink();
  const std::vector<StreamPosition> places{{ann, 5, 1}, {bob, 8, 2}};
  const std::vector<std::uint32_t> bodies{ann, pipeline::kNoStream, bob};
  const std::string words = "three bodies";
  const auto row = pipeline::pack_description(bodies, bytes_of(words));
  sink.chunk(1, 0, Direction::kDescription, 7, {.item = 40, .streams = places}, row);
  sink.chunk(1, 2, Direction::kFromDevice, 9, {.item = 41, .streams = places}, bytes_of("data"));
  sink.decision({.stream = bob, .item = 41, .sequence = 8});
  sink.published(ann, 5, false, bytes_of("frame"));
  put_chunk(sink, 0, 3, "glove");
  REQUIRE((*recorder)->finish());

  auto reader = log::Reader::open(options.file);
  REQUIRE(reader);
  REQUIRE(reader->sources().size() == 2);
  CHECK(ids_of(*reader) == std::vector<std::uint32_t>{0, ann, bob});
  const log::StreamRow& first = reader->streams()[1];
  CHECK(first.source == 1);
  CHECK(first.body == "Ann");
  CHECK(first.name == "mocap-ann");
  CHECK(first.first_item == 40);
  const auto settings = settings_from_json(first.stages_json, "");
  REQUIRE(settings);
  CHECK(reader->blob(settings->stages[0].model_sha256)->size() == 5);
  auto chunk = reader->next_chunk();
  REQUIRE((chunk && *chunk));
  CHECK((*chunk)->direction == static_cast<std::uint8_t>(Direction::kDescription));
  const auto listed = pipeline::unpack_description((*chunk)->bytes);
  REQUIRE(listed);
  CHECK(listed->streams == bodies);
  CHECK(std::ranges::equal(listed->description, bytes_of(words)));
  chunk = reader->next_chunk();
  REQUIRE((chunk && *chunk));
  CHECK((*chunk)->source == 1);
  CHECK((*chunk)->socket == 2);
  CHECK((*chunk)->first_item == 41);
  REQUIRE((*chunk)->places.size() == 2);
  CHECK((*chunk)->places[1].stream == bob);
  CHECK((*chunk)->places[1].next_frame == 8);
  CHECK((*chunk)->places[1].next_sample == 2);
  CHECK(std::ranges::equal((*chunk)->bytes, bytes_of("data")));
  CHECK(reader->decisions()->size() == 1);
  CHECK(gaps(options.file).empty());
}

TEST_CASE("a stream that comes late has its row from the first record that names it") {
  BodiesRecording loop(many_bodies(4096, 2, {.frame_bytes = 4096, .decisions = 8}));
  const std::uint32_t early = stream_id(0, 0), late = stream_id(1, 3);
  loop.rings.add_stream(body_stream(early, "Ann"));
  put_bodies(loop.rings, 1, {{early, 1, 1}}, bytes_of("1"));
  for (int i = 0; i < 6; ++i) loop.turn();
  CHECK(ids_of(*log::Reader::open(loop.path)) == std::vector{early});  // committed
  loop.rings.add_stream(body_stream(late, "Bob"));
  for (int i = 0; i < 6; ++i) loop.turn();
  CHECK(ids_of(*log::Reader::open(loop.path)) == std::vector{early});  // nothing names it yet
  SECTION("a chunk, although its frame is written first") {
    put_bodies(loop.rings, 9, {{early, 5, 1}, {late, 1, 1}}, bytes_of("2"));
    loop.rings.decision({.stream = late, .item = 10, .sequence = 1});
    loop.rings.published(late, 1, false, bytes_of("frame"));
    loop.finish();
    CHECK(log::Reader::open(loop.path)->streams()[1].first_item == 9);
  }
  SECTION("a decision") {
    loop.rings.decision({.stream = late, .item = 10, .sequence = 1});
    loop.finish();
    CHECK(log::Reader::open(loop.path)->streams()[1].first_item == 10);
  }
  SECTION("a frame") {
    loop.rings.published(late, 1, false, bytes_of("frame"));
    loop.finish();
    CHECK(log::Reader::open(loop.path)->streams()[1].first_item == 0);
  }
  CHECK(ids_of(*log::Reader::open(loop.path)) == std::vector{early, late});
}

TEST_CASE("records of a stream that nobody added are ignored") {
  BodiesRecording loop(many_bodies(4096, 1, {.frame_bytes = 4096, .decisions = 8}));
  for (const std::uint32_t id : {stream_id(0, 0), stream_id(0, 7), stream_id(9, 0)}) {
    put_bodies(loop.rings, 1, {{id, 1, 1}}, bytes_of("1"));
    loop.rings.decision({.stream = id, .item = 1, .sequence = 1});
    loop.rings.published(id, 1, false, bytes_of("frame"));
    loop.rings.unpublished(id);
  }
  loop.finish();
  auto reader = log::Reader::open(loop.path);
  REQUIRE(reader);
  CHECK(reader->streams().empty());
  CHECK(reader->decisions()->empty());
  CHECK((*reader->next_chunk())->bytes.size() == 1);
}

TEST_CASE("sources and slots do not take each other's space, and an event names who lost") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  const SlotSizes slot{.frame_bytes = 0, .decisions = 4};
  RecordRings rings({.chunk_bytes = {4096, 1024}, .slots = {slot, slot, slot}});
  auto writer = make_writer(path, 1);
  REQUIRE(writer.add(toy_source("mocap", 1)));
  std::vector<RecorderEvent> events;
  add_one_body_streams(rings, 1);
  LogWriterLoop log_writer(rings, std::move(writer), path,
                           [&](const RecorderEvent& event) { events.push_back(event); });
  const std::vector<StreamPosition> places{{stream_id(1, 1), 1, 1}, {stream_id(2, 1), 1, 1}};
  for (const StreamPosition& place : places) {
    rings.add_stream({.id = place.stream, .source = 1, .body = "b", .name = "n"});
  }
  const std::string line(400, '1');
  for (int i = 0; i < 100; ++i) {
    rings.chunk(1, 0, Direction::kFromDevice, 1, {.item = 1, .streams = places}, bytes_of(line));
    rings.decision({.stream = stream_id(1, 1), .item = 1, .sequence = 1});
  }
  for (std::uint64_t i = 1; i <= 4; ++i) {
    put_chunk(rings, 0, i, line);
    rings.decision({.stream = 0, .item = 1, .sequence = 1});
    rings.decision({.stream = stream_id(2, 1), .item = 1, .sequence = 1});
  }
  log_writer.turn(kTurn_ns);
  REQUIRE(events.size() == 2);
  CHECK(events[0].streams == std::vector{stream_id(1, 1), stream_id(2, 1)});  // chunks
  CHECK(events[1].streams == std::vector{stream_id(1, 1)});                   // decisions
  REQUIRE(log_writer.finish(2 * kTurn_ns));
  const auto rows = gaps(path);
  CHECK(rows.size() == 2);
  CHECK(lost(rows, 1, GapKind::kChunks) == 98);
  CHECK(lost(rows, stream_id(1, 1), GapKind::kDecisions) == 96);
  CHECK(log_writer.lost_chunks() == 98);
}

TEST_CASE("the rings of a setup hold 5 s of a device and any description of bodies") {
  const RecordedSetup setup{
      .sources = {{.row = toy_source("glove"), .rate_hz = 100.0},
                  {.row = toy_source("mocap"), .rate_hz = 10.0, .bodies = 4},
                  {.row = toy_source("large"), .rate_hz = 240.0, .bodies = 64}},
      .slots = 65};
  RingSizes sizes = ring_sizes(setup, false);
  REQUIRE(sizes.chunk_bytes.size() == 3);
  CHECK(sizes.chunk_bytes[0] >= 2'000'000);
  CHECK(sizes.chunk_bytes[1] >= 8 * 256 * 1024);
  CHECK(sizes.chunk_bytes[2] > 5 * 240 * 16 * 1472);
  CHECK(sizes.slots.size() == 65);
  CHECK(sizes.slots[64].frame_bytes == 0);
  CHECK(sizes.slots[64].decisions * 4 == sizes.slots[0].decisions);
  sizes = ring_sizes(setup, true);
  CHECK(sizes.slots[0].frame_bytes >= 4'000'000);
  CHECK(64 * sizes.slots[64].frame_bytes <= 128 * 1024 * 1024);
}
