// The recorder: every record that fitted is in the log, and every one that did not is counted
// there.
#include <catch2/catch.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "models/style/live/style_type.hpp"
#include "proto/log/digest.hpp"
#include "tests/support/file_limit.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/daemon/record/toy_recording.hpp"

using namespace posed;
using namespace posed::record;
using namespace posed::test;

TEST_CASE("what two hot threads give to the record sink is complete and in order in the log") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  RecordRings rings(ring_sizes_of(2, 4096, {.frame_bytes = 4096, .decisions = 64}));
  add_one_body_streams(rings, 2);
  LogWriterLoop log_writer(rings, make_writer(path, 2), path, [](const RecorderEvent&) {});
  constexpr std::uint64_t kChunks = 5000;
  std::atomic<bool> running{true};
  std::atomic<std::uint64_t> refused{0};
  std::thread reader([&] {
    for (std::uint64_t i = 1; i <= kChunks; ++i) {
      const auto stream = static_cast<std::uint32_t>(i % 2);
      const auto before = rings.losses_of_source(stream).total.load();
      put_chunk(rings, stream, i, std::string(i % 700, 'x'));
      if (rings.losses_of_source(stream).total.load() != before) ++refused;
    }
    running = false;
  });
  std::int64_t now_ns = 0;
  while (running) log_writer.turn(now_ns += kTurn_ns);
  reader.join();
  REQUIRE(log_writer.finish(now_ns));
  const auto found = sequences(path);
  CHECK(found[0].size() + found[1].size() + refused == kChunks);
  CHECK(log_writer.lost_chunks() == refused);
  for (std::uint32_t id = 0; id < 2; ++id) {
    CHECK(std::is_sorted(found[id].begin(), found[id].end()));
  }
  auto log = log::Reader::open(path);
  REQUIRE(log);
  for (auto chunk = log->next_chunk(); chunk && chunk->has_value(); chunk = log->next_chunk()) {
    REQUIRE((*chunk)->bytes.size() == (*chunk)->places[0].next_frame % 700);
  }
}

TEST_CASE("a full ring becomes a gap row where it happened, and is reported once") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  RecordRings rings(ring_sizes_of(2, 1024, {.frame_bytes = 1024, .decisions = 2}));
  std::vector<RecorderEvent> events;
  add_one_body_streams(rings, 2);
  LogWriterLoop log_writer(rings, make_writer(path, 2), path,
                           [&](const RecorderEvent& event) { events.push_back(event); });
  const std::string line(400, '1');
  for (std::uint64_t i = 1; i <= 6; ++i) put_chunk(rings, 0, i, line);  // two fit
  for (std::uint64_t i = 1; i <= 5; ++i) rings.decision({.stream = 1, .item = i});
  for (std::uint64_t i = 1; i <= 4; ++i) rings.published(0, i, false, bytes_of(line));
  log_writer.turn(kTurn_ns);
  CHECK(events.size() == 3);
  put_chunk(rings, 0, 7, line);
  log_writer.turn(2 * kTurn_ns);
  CHECK(events.size() == 3);
  CHECK(log_writer.lost_chunks() == 4);
  CHECK(log_writer.lost_frames() == 2);
  REQUIRE(log_writer.finish(3 * kTurn_ns));
  CHECK(sequences(path)[0] == std::vector<std::uint64_t>{1, 2, 7});
  const auto rows = gaps(path);
  CHECK(rows.front().after_chunk == 2);
  CHECK(lost(rows, 0, GapKind::kChunks) == 4);
  CHECK(lost(rows, 1, GapKind::kDecisions) == 3);
  CHECK(lost(rows, 0, GapKind::kFrames) == 2);
}

TEST_CASE("a source that can wait is told when more than half of its room is taken") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  RecordRings rings(ring_sizes_of(2, 2048, {.frame_bytes = 2048, .decisions = 8}));
  add_one_body_streams(rings, 2);
  LogWriterLoop log_writer(rings, make_writer(path, 2), path, [](const RecorderEvent&) {});
  const std::string line(400, '1');
  for (std::uint64_t i = 1; i <= 3; ++i) {
    CHECK(rings.keeps_up(0, 0));
    put_chunk(rings, 0, i, line);
  }
  CHECK_FALSE(rings.keeps_up(0, 0));
  CHECK(rings.keeps_up(1, 1));
  log_writer.turn(kTurn_ns);
  CHECK(rings.keeps_up(0, 0));
  for (std::uint64_t i = 1; i <= 3; ++i) rings.published(0, i, false, bytes_of(line));
  CHECK_FALSE(rings.keeps_up(0, 0));
  log_writer.turn(2 * kTurn_ns);
  CHECK(rings.keeps_up(0, 0));
  REQUIRE(log_writer.finish(3 * kTurn_ns));
  CHECK(log_writer.lost_chunks() + log_writer.lost_frames() == 0);
}

TEST_CASE("a stream that fills its share of the rings does not affect another stream") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  RecordRings rings(ring_sizes_of(2, 4096, {.frame_bytes = 4096, .decisions = 8}));
  add_one_body_streams(rings, 2);
  LogWriterLoop log_writer(rings, make_writer(path, 2), path, [](const RecorderEvent&) {});
  const std::string line(40, '1');
  constexpr std::uint64_t kTurns = 20;
  for (std::uint64_t turn = 1; turn <= kTurns; ++turn) {
    for (std::uint64_t i = 0; i < 500; ++i) {
      put_chunk(rings, 0, 500 * turn + i, line);
      rings.decision({.stream = 0, .item = 501 * turn + i});
      rings.published(0, 500 * turn + i, false, bytes_of(line));
    }
    put_chunk(rings, 1, turn, line);
    rings.decision({.stream = 1, .item = 501 * turn + 500});
    rings.published(1, turn, false, bytes_of(line));
    log_writer.turn(static_cast<std::int64_t>(turn) * kTurn_ns);
  }
  REQUIRE(log_writer.finish(static_cast<std::int64_t>(kTurns) * kTurn_ns));
  CHECK(sequences(path)[1].size() == kTurns);
  const auto rows = gaps(path);
  for (const GapKind kind : {GapKind::kChunks, GapKind::kDecisions, GapKind::kFrames}) {
    CHECK(lost(rows, 0, kind) > 1000);
    CHECK(lost(rows, 1, kind) == 0);
  }
}

// Decisions are made later than the reader reads: the chunk that a lost decision concerns may have
// been in the log for a long time.
TEST_CASE("the gap of a lost decision begins before the chunk that it concerns") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  RecordRings rings(ring_sizes_of(1, 4096, {.frame_bytes = 0, .decisions = 1}));
  add_one_body_streams(rings, 1);
  LogWriterLoop log_writer(rings, make_writer(path, 1), path, [](const RecorderEvent&) {});
  for (std::uint64_t frame = 1; frame <= 10; ++frame) put_chunk(rings, 0, frame, "1\n");
  log_writer.turn(kTurn_ns);
  rings.decision({.stream = 0, .item = 3, .sequence = 3});
  rings.decision({.stream = 0, .item = 5, .sequence = 5});  // does not fit
  rings.decision({.stream = 0, .item = 7, .sequence = 7});  // does not fit either
  log_writer.turn(2 * kTurn_ns);
  rings.decision({.stream = 0, .item = 9, .sequence = 9});
  REQUIRE(log_writer.finish(3 * kTurn_ns));
  const auto rows = gaps(path);
  REQUIRE(rows.size() == 1);
  CHECK(rows[0].lost == 2);
  CHECK(rows[0].after_chunk == 4);
}

TEST_CASE(
    "a full disk is counted and reported; with space again recording continues after a gap row") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  RecordRings rings(ring_sizes_of(2, 1 << 20, {.frame_bytes = 0, .decisions = 64}));
  std::vector<RecorderEvent> events;
  add_one_body_streams(rings, 2);
  LogWriterLoop log_writer(rings, make_writer(path, 2), path,
                           [&](const RecorderEvent& event) { events.push_back(event); });
  const std::string model = "model bytes";
  const std::string line(20'000, '1');
  std::uint64_t sequence = 0;
  std::int64_t now_ns = 0;
  const auto turns = [&](int count) {
    for (int i = 0; i < count; ++i) {
      put_chunk(rings, 0, ++sequence, line);
      put_chunk(rings, 1, sequence, "short");
      rings.decision({.stream = 1, .item = sequence});
      log_writer.turn(now_ns += kTurn_ns);
    }
  };
  turns(10);
  CHECK(log_writer.errors() == 0);
  {
    const FileLimit limit(400'000);
    rings.keep_model(bytes_of(model));
    turns(100);  // five seconds: several retries
    CHECK(log_writer.errors() >= 1);
    REQUIRE(!events.empty());
    CHECK(events.front().kind == RecorderEvent::Kind::kError);
    CHECK(events.front().text.find(path.string()) != std::string::npos);
  }
  turns(400);
  CHECK(events.size() < 16);  // retries slow down, and so do the events
  REQUIRE(log_writer.finish(now_ns));
  const auto found = sequences(path);
  const auto rows = gaps(path);
  CHECK(found[0].back() == sequence);
  CHECK(found[0].size() + lost(rows, 0, GapKind::kChunks) == sequence);
  CHECK(found[1].size() + lost(rows, 1, GapKind::kChunks) == sequence);
  CHECK(lost(rows, 0, GapKind::kChunks) > 50);
  CHECK(lost(rows, 1, GapKind::kDecisions) > 50);
  CHECK(log_writer.lost_chunks() ==
        lost(rows, 0, GapKind::kChunks) + lost(rows, 1, GapKind::kChunks));
  // A model that came while the disk was full is in the log: its bytes were kept in memory.
  const auto reader = log::Reader::open(path);
  REQUIRE(reader);
  CHECK(reader->blob(log::sha256_hex(bytes_of(model))));
}

TEST_CASE("a model that comes again is kept once, so a full disk does not fill the memory") {
  RecordRings rings(ring_sizes_of(1, 1 << 12, {}));
  rings.keep_model(bytes_of("model"));
  rings.keep_model(bytes_of("another"));
  rings.keep_model(bytes_of("model"));
  CHECK(rings.next_models().size() == 2);
  rings.keep_model(bytes_of("another"));
  CHECK(rings.next_models().empty());
}

TEST_CASE("the recorder's thread writes by its own timer and leaves one file") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  const Clock clock = []() noexcept -> std::int64_t {
    return std::chrono::steady_clock::now().time_since_epoch().count();
  };
  pipeline::StreamSettings settings;
  settings.stages.push_back(pipeline::stage_settings(style::style_type()));
  const RecordedSetup setup{.sources = {{.row = toy_source("a")}}, .slots = 1};
  RecorderOptions options;
  options.file = path;
  options.frames = true;
  options.config_text = "x";
  options.clock = clock;
  auto recorder = Recorder::open(options, setup);
  REQUIRE(recorder);
  (*recorder)->add_stream({.id = 0,
                           .source = 0,
                           .from_start = true,
                           .name = "a",
                           .settings = settings,
                           .model_files = {std::make_shared<const std::string>("12")}});
  CHECK((*recorder)->record_sink().wants_published());
  for (std::uint64_t i = 1; i <= 100; ++i) {
    put_chunk((*recorder)->record_sink(), 0, i, "1 2 3\n");
    (*recorder)->record_sink().published(0, i, false, bytes_of("frame"));
  }
  REQUIRE((*recorder)->finish());
  CHECK(!std::filesystem::exists(path.string() + "-wal"));
  CHECK(sequences(path)[0].size() == 100);
  CHECK(gaps(path).empty());
  const auto reader = log::Reader::open(path);
  REQUIRE(reader);
  CHECK(reader->meta().at("config") == "x");
  CHECK(reader->meta().contains("isa"));
  const auto read = settings_from_json(reader->streams()[0].stages_json, "");
  REQUIRE(read);
  CHECK(reader->blob(read->stages[0].model_sha256)->size() == 2);

  const auto again = Recorder::open(options, setup);
  REQUIRE(!again);
  CHECK(again.error().message.find("exists already") != std::string::npos);
}

// A source whose chunks are written one a turn.
struct OneSource {
  RecordRings rings{ring_sizes_of(1, 1 << 16, {.frame_bytes = 0, .decisions = 64})};
  std::vector<RecorderEvent> events;
  LogWriterLoop log_writer;
  std::int64_t now_ns = 0;
  std::uint64_t sequence = 0;

  OneSource(const std::filesystem::path& path, log::Writer writer)
      : log_writer(rings, std::move(writer), path,
                   [this](const RecorderEvent& event) { events.push_back(event); }) {
    add_one_body_streams(rings, 1);
  }
  void turns(int count) {
    for (int i = 0; i < count; ++i) {
      put_chunk(rings, 0, ++sequence, "1\n");
      log_writer.turn(now_ns += kTurn_ns);
    }
  }
};

TEST_CASE("a log that is deleted or replaced while it is written is reported at once") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog", moved = dir.path() / "moved.plog";
  OneSource recorder(path, make_writer(path, 1));
  auto& [rings, events, log_writer, now_ns, sequence] = recorder;
  recorder.turns(20);
  CHECK(rings.state().trouble.empty());
  std::filesystem::rename(path, moved);
  std::string there;
  SECTION("deleted") {}
  SECTION("replaced") { there = dir.write("a.plog", "of somebody else"); }
  recorder.turns(6);
  REQUIRE(events.size() == 1);
  CHECK(events[0].kind == RecorderEvent::Kind::kError);
  CHECK(rings.state().trouble.find("deleted, moved or replaced") != std::string::npos);
  recorder.turns(100);
  CHECK_FALSE(rings.state().trouble.empty());
  CHECK(events.size() == 1);
  if (!there.empty()) CHECK(file_text(there) == "of somebody else");
  std::filesystem::rename(moved, path);  // put back
  recorder.turns(400);
  CHECK(rings.state().trouble.empty());
  REQUIRE(log_writer.finish(now_ns));
  const auto found = sequences(path);
  CHECK(found[0].back() == sequence);
  CHECK(found[0].size() + lost(gaps(path), 0, GapKind::kChunks) == sequence);
}

TEST_CASE(
    "a log that is cut short while it is written is reported at once and never called whole") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  const auto wal = path.string() + "-wal";
  OneSource recorder(path, make_writer(path, 1));
  auto& [rings, events, log_writer, now_ns, sequence] = recorder;
  recorder.turns(300);
  REQUIRE(std::filesystem::file_size(path) > 0);
  SECTION("to nothing") { std::filesystem::resize_file(path, 0); }
  SECTION("to its half") { std::filesystem::resize_file(path, 12288); }
  SECTION("its -wal") { std::filesystem::resize_file(wal, 0); }
  SECTION("its -wal in part") {
    std::filesystem::resize_file(wal, std::filesystem::file_size(wal) / 2);
  }
  SECTION("its -wal away") { std::filesystem::remove(wal); }
  recorder.turns(6);
  REQUIRE(events.size() == 1);
  CHECK(events[0].kind == RecorderEvent::Kind::kError);
  CHECK(rings.state().trouble.find("cut short") != std::string::npos);
  recorder.turns(400);
  const auto finished = log_writer.finish(now_ns);
  CHECK_FALSE(finished);
  CHECK(log_writer.errors() > 1);
}

TEST_CASE("a log that was overwritten while it was written is not called whole") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  OneSource recorder(path, make_writer(path, 1));
  auto& [rings, events, log_writer, now_ns, sequence] = recorder;
  recorder.turns(3000);
  const auto size = std::filesystem::file_size(path);
  REQUIRE(size > 16384);
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(8192);
  file << std::string(size - 8192, '!');
  file.close();
  CHECK_FALSE(log_writer.finish(now_ns));
  CHECK(log_writer.errors() == 1);
}

TEST_CASE("a log that a full disk keeps from beginning begins when there is room") {
  const TempFolder dir;
  const auto path = dir.path() / "a.plog";
  OneSource recorder(path, log::Writer(path, {.sources = {toy_source("s0")}}, false));
  auto& [rings, events, log_writer, now_ns, sequence] = recorder;
  {
    const FileLimit limit(100);
    recorder.turns(40);
    REQUIRE(events.size() == 1);
    CHECK(events[0].text.find("streaming continues") != std::string::npos);
  }
  recorder.turns(100);
  REQUIRE(log_writer.finish(now_ns));
  const auto found = sequences(path);
  CHECK(found[0].back() == sequence);
  CHECK(found[0].size() + lost(gaps(path), 0, GapKind::kChunks) == sequence);
}
