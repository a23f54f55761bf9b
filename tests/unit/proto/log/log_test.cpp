// The device log: rows are read back as written, a crash loses only what was not committed, and a
// file that is not a complete log gives one error message.
#include <catch2/catch.hpp>

#include <atomic>
#include <barrier>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "posed/v1/log.pb.h"
#include "proto/log/database.hpp"
#include "proto/log/digest.hpp"
#include "proto/log/reader.hpp"
#include "proto/log/writer.hpp"
#include "tests/support/file_limit.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/log_surgery.hpp"
#include "tests/support/shared.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/proto/log/toy_log.hpp"

using namespace posed;
using log::Reader;
using log::Writer;
using test::bytes_of;
using test::chunk_row;
using test::forge;
using test::run_sql;
using test::text_of;
using test::writer_with_two_streams;

namespace {

// A small log that was closed properly.
void write_whole_log(const std::filesystem::path& path, int chunks) {
  Writer writer = writer_with_two_streams(path);
  const std::string line(1000, '7');
  for (int i = 0; i < chunks; ++i) {
    const auto sequence = static_cast<std::uint64_t>(i + 1);
    REQUIRE(writer.add(chunk_row(static_cast<std::uint32_t>(i % 2), sequence, line)));
  }
  REQUIRE(writer.close());
}

std::size_t count_chunks(Reader& reader) {
  std::size_t count = 0;
  for (;;) {
    const auto chunk = reader.next_chunk();
    REQUIRE(chunk);
    if (!chunk->has_value()) return count;
    ++count;
  }
}

std::string log_refusal(const std::filesystem::path& path) {
  const auto reader = Reader::open(path);
  REQUIRE(!reader);
  CHECK(reader.error().file == path.string());
  return reader.error().message;
}

}  // namespace

TEST_CASE("sha256 names bytes as the standard does") {
  CHECK(log::sha256_hex({}) == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(log::sha256_hex(bytes_of("abc")) ==
        "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST_CASE("a log gives back every row it was given") {
  const test::TempFolder dir;
  const auto path = dir.path() / "a.plog";
  constexpr std::uint32_t kLate = 3U << 16U | 5U;  // ids are names, not indices
  constexpr std::uint64_t kMaxId = ~std::uint64_t{0};
  Writer writer = writer_with_two_streams(path);
  REQUIRE(writer.add(log::StreamRow{kLate, 1, "Ann", "b-ann", "{\"stages\":[]}", 40}));
  const std::vector<log::StreamPosition> places{{1, 7, 8}, {kLate, 300, kMaxId}};
  REQUIRE(writer.add(log::ChunkRow{.source = 1,
                                   .socket = 2,
                                   .direction = 3,
                                   .arrival_ns = -5,
                                   .first_item = 11,
                                   .places = places,
                                   .bytes = bytes_of("1 2 3\n")}));
  REQUIRE(writer.add(chunk_row(0, 1, "")));
  CHECK(writer.last_chunk_id() == 2);
  REQUIRE(writer.add(log::DecisionRow{.item = kMaxId,
                                      .stream = kLate,
                                      .stage = "style",
                                      .name = "alpha",
                                      .value = "v",
                                      .now_ns = -9}));
  REQUIRE(writer.add(log::FrameRow{1, 7, true, bytes_of("raw")}));
  REQUIRE(writer.add(log::FrameRow{1, 7, false, bytes_of("styled")}));
  REQUIRE(writer.add(log::GapRow{log::GapRow::Kind::kDecisions, kLate, 2, 11, 99}));
  const auto hash = writer.add_blob(bytes_of("model"));
  REQUIRE(hash);
  CHECK(*writer.add_blob(bytes_of("model")) == *hash);
  REQUIRE(writer.close());
  CHECK(!std::filesystem::exists(path.string() + "-wal"));
  forge(path, "INSERT INTO take VALUES(1, 'jump', 12, 40, '', 0)");

  auto reader = Reader::open(path);
  REQUIRE(reader);
  CHECK(reader->meta().at("isa") == "avx2");
  REQUIRE(reader->sources().size() == 2);
  CHECK(reader->sources()[1].text == "HIERARCHY\n");
  CHECK(reader->sources()[1].config == "{\"path\":\"walk.bvh\"}");
  REQUIRE(reader->streams().size() == 3);
  const log::StreamRow& late = reader->streams()[2];
  CHECK(late.id == kLate);
  CHECK(late.body == "Ann");
  CHECK(late.name == "b-ann");
  CHECK(late.stages_json == "{\"stages\":[]}");
  CHECK(late.first_item == 40);
  CHECK(reader->source_of(late).name == "b");
  auto chunk = reader->next_chunk();
  REQUIRE((chunk && chunk->has_value()));
  CHECK((*chunk)->source == 1);
  CHECK((*chunk)->socket == 2);
  CHECK((*chunk)->direction == 3);
  CHECK((*chunk)->arrival_ns == -5);
  CHECK((*chunk)->first_item == 11);
  REQUIRE((*chunk)->places.size() == 2);
  CHECK((*chunk)->places[1].stream == kLate);
  CHECK((*chunk)->places[1].next_frame == 300);
  CHECK((*chunk)->places[1].next_sample == kMaxId);
  CHECK(text_of((*chunk)->bytes) == "1 2 3\n");
  chunk = reader->next_chunk();
  REQUIRE((chunk && chunk->has_value()));
  CHECK((*chunk)->bytes.empty());
  CHECK(count_chunks(*reader) == 0);
  CHECK(count_chunks(*reader) == 0);  // reading on after the end gives no rows

  const auto decisions = reader->decisions();
  REQUIRE((decisions && decisions->size() == 1));
  CHECK(decisions->front().item == kMaxId);
  CHECK(decisions->front().stream == kLate);
  CHECK(decisions->front().stage == "style");
  CHECK(decisions->front().name == "alpha");
  CHECK(decisions->front().value == "v");
  CHECK(decisions->front().now_ns == -9);
  auto frames = reader->frames(1, false);
  REQUIRE(frames);
  const auto frame = frames->next();
  REQUIRE((frame && frame->has_value()));
  CHECK(text_of((*frame)->bytes) == "styled");
  CHECK(!frames->next()->has_value());
  CHECK(*reader->has_frames());
  const auto gaps = reader->gaps();
  REQUIRE((gaps && gaps->size() == 1));
  CHECK(gaps->front().lost == 11);
  CHECK(gaps->front().owner == kLate);
  CHECK(gaps->front().kind == log::GapRow::Kind::kDecisions);
  const auto takes = reader->takes();
  REQUIRE((takes && takes->size() == 1));
  CHECK(takes->front().name == "jump");
  CHECK(takes->front().last_item == 40);
  CHECK(text_of(*reader->blob(*hash)) == "model");
  CHECK(!reader->blob("none"));
}

TEST_CASE("a log of a development version or of a newer posed is refused by its format") {
  const test::TempFolder dir;
  for (const auto& [format, words] : {std::pair("2", "development version"),
                                      {"5", "newer posed"},
                                      {"0", "development version"}}) {
    const auto path = dir.path() / (std::string(format) + ".plog");
    std::filesystem::copy_file(test::golden("replay/staged.plog"), path);
    run_sql(path, std::string("PRAGMA user_version=") + format);
    const auto reader = Reader::open(path);
    REQUIRE_FALSE(reader);
    CHECK(reader.error().text().contains(words));
    CHECK(reader.error().text().contains(std::string("log format ") + format));
  }
}

TEST_CASE("a file that is there, or a part of a log, is never touched by a new log") {
  const test::TempFolder dir;
  const auto path = dir.path() / "a.plog";
  std::string there = "a.plog";
  SECTION("a log") { write_whole_log(path, 3); }
  SECTION("an empty file, which another writer has just made") { std::ofstream{path}; }
  SECTION("a dangling link") { std::filesystem::create_symlink("nowhere", path); }
  SECTION("what a crash has left of a log that was moved away") {
    there = dir.write("a.plog-wal", "the last second").filename();
  }
  const auto before = test::file_text(dir.path() / there);
  const auto refused = Writer::create(path, {});
  REQUIRE(!refused);
  CHECK(refused.error().text().find("exists already") != std::string::npos);
  CHECK(test::file_text(dir.path() / there) == before);
  CHECK(std::distance(std::filesystem::directory_iterator(dir.path()), {}) == 1);
}

TEST_CASE("of many that begin a log of one name at once one has it, whole") {
  constexpr int kWriters = 8, kRounds = 10;
  const test::TempFolder dir;
  for (int round = 0; round < kRounds; ++round) {
    const auto path = dir.path() / (std::to_string(round) + ".plog");
    std::atomic<int> begun = 0;
    std::barrier start(kWriters);
    std::vector<std::jthread> threads;
    for (int i = 0; i < kWriters; ++i) {
      threads.emplace_back([&, i] {
        start.arrive_and_wait();
        auto writer = Writer::create(path, {.meta = {{"writer", std::to_string(i)}}});
        if (!writer) return;
        ++begun;
        if (!writer->close()) begun = kWriters;
      });
    }
    threads.clear();
    REQUIRE(begun == 1);
    REQUIRE(Reader::open(path));
  }
}

TEST_CASE("a log that could not be begun is begun later, or leaves nothing") {
  const test::TempFolder dir;
  const auto path = dir.path() / "a.plog";
  REQUIRE(log::reserve(path).value() == log::Reserved::kYes);
  {
    Writer writer(path, {.sources = {{0, "s", "file", "", "", "{}"}}}, true);
    {
      const test::FileLimit full(100);
      REQUIRE(!writer.resume());
    }
    CHECK_FALSE(writer.is_open());
    SECTION("later") {
      REQUIRE(writer.resume());
      REQUIRE(writer.close());
      CHECK(Reader::open(path)->sources().size() == 1);
    }
  }
  if (!Reader::open(path)) CHECK(std::filesystem::is_empty(dir.path()));
}

TEST_CASE("a log of which nothing was committed leaves no file, unless that is of somebody else") {
  const test::TempFolder dir;
  const auto path = dir.path() / "a.plog";
  SECTION("in place") {
    REQUIRE(Writer::create(path, {.meta = {{"writer", "1"}}}));
    CHECK(std::filesystem::is_empty(dir.path()));
  }
  SECTION("replaced") {
    {
      const auto writer = Writer::create(path, {.meta = {{"writer", "1"}}});
      std::filesystem::remove(path);
      dir.write("a.plog", "of somebody else");
    }
    CHECK(std::filesystem::file_size(path) == 16);
  }
  SECTION("closed") {
    REQUIRE(Writer::create(path, {.meta = {{"writer", "1"}}})->close());
    CHECK(Reader::open(path));
  }
}

TEST_CASE("a writer goes on with its own log only, and leaves what has taken its name") {
  const test::TempFolder dir;
  const auto path = dir.path() / "a.plog", moved = dir.path() / "moved.plog";
  auto writer = Writer::create(path, {.meta = {{"writer", "1"}}});
  REQUIRE(writer);
  REQUIRE(writer->add(log::SourceRow{0, "s", "file", "", "", "{}"}));
  REQUIRE(writer->commit());
  CHECK(writer->is_in_place());
  std::filesystem::rename(path, moved);
  CHECK_FALSE(writer->is_in_place());
  for (const char* suffix : {"-wal", "-shm"}) std::filesystem::remove(path.string() + suffix);
  auto other = Writer::create(path, {.meta = {{"writer", "2"}}});
  REQUIRE(other);
  CHECK_FALSE(writer->is_in_place());
  writer->interrupt();
  REQUIRE(other->add(log::SourceRow{7, "other", "file", "", "", "{}"}));
  REQUIRE(other->commit());
  const auto refused = writer->resume();
  REQUIRE(!refused);
  CHECK(refused.error().text().find("another recording has this name") != std::string::npos);
  REQUIRE(other->close());
  CHECK(Reader::open(path)->sources().front().id == 7);
  CHECK(Reader::open(moved)->sources().front().id == 0);
}

TEST_CASE("after a crash the log opens with everything that was committed, as one file") {
  const test::TempFolder dir;
  const auto path = dir.path() / "live.plog", crashed = dir.path() / "crashed.plog";
  Writer writer = writer_with_two_streams(path);
  for (std::uint64_t i = 1; i <= 40; ++i) REQUIRE(writer.add(chunk_row(0, i, "1 2 3\n")));
  REQUIRE(writer.commit());
  for (std::uint64_t i = 41; i <= 50; ++i) REQUIRE(writer.add(chunk_row(0, i, "1 2 3\n")));
  // What kill -9 leaves: the file and its -wal in their present state.
  std::filesystem::copy_file(path, crashed);
  std::filesystem::copy_file(path.string() + "-wal", crashed.string() + "-wal");
  auto reader = Reader::open(crashed);
  REQUIRE(reader);
  CHECK(count_chunks(*reader) == 40);
  CHECK(!std::filesystem::exists(crashed.string() + "-wal"));
  REQUIRE(writer.close());
}

// The -wal of a recording that was killed, whose file was then replaced by another log.
TEST_CASE("what lies beside a log and is not its own changes nothing in it") {
  const test::TempFolder dir;
  const auto recorded = [&](const char* name, std::uint64_t chunks) {
    auto writer = Writer::create(dir.path() / name, {.meta = {{"writer", name}}});
    REQUIRE(writer);
    REQUIRE(writer->add(log::SourceRow{0, "glove", "cyberglove", "", "", "{}"}));
    for (std::uint64_t i = 1; i <= chunks; ++i) {
      REQUIRE(writer->add(chunk_row(0, i, std::string(500, 'a'))));
    }
    REQUIRE(writer->commit());
    return std::move(*writer);
  };
  Writer good = recorded("good.plog", 40);
  REQUIRE(good.close());
  const auto path = dir.path() / "good.plog";
  const std::string before = test::file_text(path);
  SECTION("a -wal of as many rows") {
    Writer killed = recorded("killed.plog", 40);
    std::filesystem::copy_file(dir.path() / "killed.plog-wal", path.string() + "-wal");
    const auto refused = Reader::open(path);
    REQUIRE(!refused);
    CHECK(refused.error().text().find("-wal beside it is of another recording") !=
          std::string::npos);
    CHECK(test::file_text(path) == before);
    std::filesystem::remove(path.string() + "-wal");
    REQUIRE(killed.close());
  }
  SECTION("a -journal") {
    dir.write("good.plog-journal", std::string(2000, 'x'));
    REQUIRE(!Reader::open(path));
    CHECK(test::file_text(path) == before);
    std::filesystem::remove(path.string() + "-journal");
  }
  auto reader = Reader::open(path);
  REQUIRE(reader);
  CHECK(count_chunks(*reader) == 40);
}

TEST_CASE("a log can be read while it is being recorded, and recording goes on") {
  const test::TempFolder dir;
  const auto path = dir.path() / "live.plog";
  Writer writer = writer_with_two_streams(path);
  REQUIRE(writer.add(chunk_row(0, 1, "1\n")));
  REQUIRE(writer.commit());
  {
    auto reader = Reader::open(path);
    REQUIRE(reader);
    REQUIRE(writer.add(chunk_row(0, 2, "2\n")));
    REQUIRE(writer.commit());
    CHECK(count_chunks(*reader) == 2);
  }
  REQUIRE(writer.add(chunk_row(0, 3, "3\n")));
  REQUIRE(writer.close());
  auto reader = Reader::open(path);
  REQUIRE(reader);
  CHECK(count_chunks(*reader) == 3);
}

TEST_CASE("a file that is not a complete log is refused with one error message") {
  const test::TempFolder dir;
  const auto path = dir.path() / "x.plog";
  SECTION("missing") { CHECK(log_refusal(path).find("No such file") != std::string::npos); }
  SECTION("a folder") {
    std::filesystem::create_directory(path);
    CHECK(log_refusal(path) == "is a folder, not a log");
  }
  SECTION("empty") {
    std::ofstream{path};
    CHECK(log_refusal(path).find("not a device log") != std::string::npos);
  }
  SECTION("text") {
    std::ofstream{path} << std::string(5000, 'x');
    CHECK(log_refusal(path) == "not a device log (not an SQLite file)");
  }
  SECTION("another database") {
    run_sql(path, "CREATE TABLE chunk(id); INSERT INTO chunk VALUES(1);");
    CHECK(log_refusal(path).find("not posed's") != std::string::npos);
  }
  SECTION("another table") {
    write_whole_log(path, 3);
    run_sql(path, "DROP TABLE chunk; CREATE TABLE chunk(id, other);");
    CHECK(log_refusal(path).find("tables are not those") != std::string::npos);
  }
  SECTION("a newer format") {
    write_whole_log(path, 3);
    run_sql(path, "PRAGMA user_version=5;");
    CHECK(log_refusal(path).find("update posed") != std::string::npos);
  }
  SECTION("a source that is not described") {
    write_whole_log(path, 3);
    forge(path, "UPDATE chunk SET source=-1;");
    auto reader = Reader::open(path);
    REQUIRE(reader);
    const auto chunk = reader->next_chunk();
    REQUIRE(!chunk);
    CHECK(chunk.error().message.find("row 1 of table chunk names source -1, which") !=
          std::string::npos);
  }
  SECTION("cut short anywhere, or with pages overwritten: refused or read, never a crash") {
    write_whole_log(path, 60);
    const auto size = std::filesystem::file_size(path);
    std::filesystem::resize_file(path, size / 2);
    CHECK(log_refusal(path).find("damaged") != std::string::npos);
    for (std::uintmax_t keep = 0; keep < size; keep += size / 37) {
      const auto cut = dir.path() / ("cut" + std::to_string(keep));
      write_whole_log(cut, 60);
      std::filesystem::resize_file(cut, keep);
      CHECK(!log_refusal(cut).empty());
      const auto scribbled = dir.path() / ("scribbled" + std::to_string(keep));
      write_whole_log(scribbled, 60);
      std::fstream(scribbled, std::ios::in | std::ios::out | std::ios::binary)
          .seekp(static_cast<std::streamoff>(keep))
          .write("\xff\xfe\xfd\xfc\xfb", 5);
      auto reader = Reader::open(scribbled);
      while (reader) {
        const auto chunk = reader->next_chunk();
        if (!chunk || !chunk->has_value()) break;
      }
    }
  }
}

TEST_CASE("a full disk is an error that ends with the cause: writing goes on afterwards") {
  const test::TempFolder dir;
  const auto path = dir.path() / "full.plog";
  Writer writer = writer_with_two_streams(path);
  REQUIRE(writer.add(chunk_row(0, 1, "1\n")));
  REQUIRE(writer.commit());
  const std::string big(60'000, '9');
  {
    const test::FileLimit limit(200'000);
    Result<> outcome;
    for (std::uint64_t i = 2; outcome && i < 100; ++i) {
      outcome = writer.add(chunk_row(0, i, big));
      if (outcome) outcome = writer.commit();
    }
    REQUIRE(!outcome);
    CHECK(outcome.error().file == path.string());
    writer.interrupt();
  }
  REQUIRE(writer.resume());
  const auto before = writer.last_chunk_id();
  CHECK(before >= 1);
  REQUIRE(writer.add(chunk_row(0, 200, big)));
  REQUIRE(writer.close());
  auto reader = Reader::open(path);
  REQUIRE(reader);
  CHECK(count_chunks(*reader) == static_cast<std::size_t>(before) + 1);
}

// What a log's tables can be replaced with or get added, so that reading runs for ever, or takes
// all memory.
TEST_CASE("a log whose tables are a program is refused before any of it runs") {
  const std::string endless =
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n) SELECT ";
  const std::vector<std::string> programs{
      "DROP TABLE meta; CREATE VIEW meta AS " + endless +
          "i AS key, hex(zeroblob(i)) AS value FROM n",
      "DROP TABLE source; CREATE VIEW source AS " + endless +
          "i AS id,'' AS name,'' AS driver,'' AS text,'' AS identity,'' AS config,0 AS crc FROM n",
      "DROP TABLE gap; CREATE VIEW gap AS " + endless +
          "i AS id,0 AS kind,0 AS owner,0 AS after_chunk,0 AS lost,0 AS time_ns,0 AS crc FROM n",
      "CREATE VIEW other AS SELECT 1",
      "CREATE TRIGGER t AFTER INSERT ON meta BEGIN DELETE FROM chunk; END",
      "CREATE INDEX again ON chunk(arrival_ns)",
      "CREATE TABLE other(a)",
      "DROP TABLE take; CREATE TABLE take(id INTEGER PRIMARY KEY, name TEXT NOT NULL, first_item "
      "INTEGER NOT NULL, last_item INTEGER NOT NULL, crc INTEGER NOT NULL, "
      "CHECK(length(replace(hex(zeroblob(60000000)),'0','aa')) > 0)) STRICT",
      "DROP TABLE take; CREATE TABLE take(id INTEGER PRIMARY KEY, name TEXT NOT NULL, first_item "
      "INTEGER NOT NULL, last_item INTEGER NOT NULL, crc INTEGER AS (hex(zeroblob(60000000))))",
      "ALTER TABLE frame ADD COLUMN more TEXT AS (hex(zeroblob(60000000)))",
  };
  const test::TempFolder dir;
  for (const std::string& program : programs) {
    INFO(program);
    const auto path = dir.path() / "a.plog";
    std::filesystem::remove(path);
    write_whole_log(path, 3);
    run_sql(path, program);
    CHECK(log_refusal(path).find("tables are not those") != std::string::npos);
  }
}

TEST_CASE("no statement on a log works for longer than the size of the log explains") {
  const test::TempFolder dir;
  const auto path = dir.path() / "a.plog";
  write_whole_log(path, 3);
  auto database = log::Database::open(path, log::Database::Mode::kReadWrite);
  REQUIRE(database);
  const auto endless = database->value(
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n) SELECT max(i) FROM n");
  REQUIRE(!endless);
  CHECK(endless.error().message.find("than its size explains") != std::string::npos);
  CHECK(database->value("SELECT count(*) FROM meta"));
}
