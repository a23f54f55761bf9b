// The device log: what goes in comes out, a crash costs what was not committed, and a file that is
// no whole log is told so in one sentence.
#include <catch2/catch.hpp>

#include <fstream>
#include <string>

#include <sqlite3.h>

#include "proto/log/digest.hpp"
#include "proto/log/reader.hpp"
#include "proto/log/writer.hpp"
#include "tests/support/file_limit.hpp"
#include "tests/support/temp_folder.hpp"

using namespace posed;
using log::Reader;
using log::Writer;

namespace {

std::span<const std::byte> bytes_of(const std::string& text) {
  return std::as_bytes(std::span(text));
}

std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

log::StreamRow stream_row(std::uint32_t id, const std::string& name) {
  return {id, name, "file", "HIERARCHY\n", "walk.bvh", "name = \"" + name + "\"", ""};
}

log::ChunkRow chunk_row(std::uint32_t stream, std::uint64_t sequence, const std::string& text) {
  return {0, stream, 0, static_cast<std::int64_t>(sequence) * 1000, sequence, bytes_of(text)};
}

Writer writer_with_two_streams(const std::filesystem::path& path) {
  auto writer = Writer::create(path, {{"posed_version", "0.1.0"}, {"isa", "avx2"}}, false);
  REQUIRE(writer);
  REQUIRE(writer->add(stream_row(0, "a")));
  REQUIRE(writer->add(stream_row(1, "b")));
  REQUIRE(writer->commit());
  return std::move(*writer);
}

// A small log that ended as it should.
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

std::string refusal(const std::filesystem::path& path) {
  const auto reader = Reader::open(path);
  REQUIRE(!reader);
  CHECK(reader.error().file == path.string());
  return reader.error().message;
}

void run_sql(const std::filesystem::path& path, const char* sql) {
  sqlite3* handle = nullptr;
  REQUIRE(sqlite3_open(path.c_str(), &handle) == SQLITE_OK);
  REQUIRE(sqlite3_exec(handle, sql, nullptr, nullptr, nullptr) == SQLITE_OK);
  sqlite3_close(handle);
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
  Writer writer = writer_with_two_streams(path);
  REQUIRE(writer.add(chunk_row(1, 7, "1 2 3\n")));
  REQUIRE(writer.add(chunk_row(0, 1, "")));
  CHECK(writer.last_chunk_id() == 2);
  REQUIRE(writer.add(log::DecisionRow{1, 3, ~std::uint64_t{0}, 5, -9, 0.25, "feed"}));
  REQUIRE(writer.add(log::FrameRow{1, 7, true, bytes_of("raw")}));
  REQUIRE(writer.add(log::FrameRow{1, 7, false, bytes_of("styled")}));
  REQUIRE(writer.add(log::GapRow{0, log::GapRow::Kind::kDecisions, 2, 11, 99}));
  const auto hash = writer.add_blob(bytes_of("model"));
  REQUIRE(hash);
  CHECK(*writer.add_blob(bytes_of("model")) == *hash);
  REQUIRE(writer.close());
  CHECK(!std::filesystem::exists(path.string() + "-wal"));

  auto reader = Reader::open(path);
  REQUIRE(reader);
  CHECK(reader->meta().at("isa") == "avx2");
  REQUIRE(reader->streams().size() == 2);
  CHECK(reader->streams()[1].name == "b");
  CHECK(reader->streams()[1].text == "HIERARCHY\n");
  CHECK(reader->streams()[1].config == "name = \"b\"");
  auto chunk = reader->next_chunk();
  REQUIRE((chunk && chunk->has_value()));
  CHECK((*chunk)->stream == 1);
  CHECK((*chunk)->next_sequence == 7);
  CHECK(text_of((*chunk)->bytes) == "1 2 3\n");
  chunk = reader->next_chunk();
  REQUIRE((chunk && chunk->has_value()));
  CHECK((*chunk)->bytes.empty());
  CHECK(count_chunks(*reader) == 0);
  CHECK(count_chunks(*reader) == 0);  // the end stays the end

  const auto decisions = reader->decisions(1);
  REQUIRE((decisions && decisions->size() == 1));
  CHECK(decisions->front().sequence == ~std::uint64_t{0});
  CHECK(decisions->front().now_ns == -9);
  CHECK(decisions->front().alpha == 0.25);
  CHECK(decisions->front().model_hash == "feed");
  CHECK(reader->decisions(0)->empty());
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
  CHECK(gaps->front().kind == log::GapRow::Kind::kDecisions);
  CHECK(text_of(*reader->blob(*hash)) == "model");
  CHECK(!reader->blob("none"));
}

TEST_CASE("an existing file is kept unless the caller insists") {
  const test::TempFolder dir;
  const auto path = dir.path() / "a.plog";
  write_whole_log(path, 3);
  const auto refused = Writer::create(path, {}, false);
  REQUIRE(!refused);
  CHECK(refused.error().text().find("exists already") != std::string::npos);
  REQUIRE(Writer::create(path, {}, true));
  CHECK(Reader::open(path)->streams().empty());
}

TEST_CASE("after a crash the log opens with everything that was committed, as one file") {
  const test::TempFolder dir;
  const auto path = dir.path() / "live.plog", crashed = dir.path() / "crashed.plog";
  Writer writer = writer_with_two_streams(path);
  for (std::uint64_t i = 1; i <= 40; ++i) REQUIRE(writer.add(chunk_row(0, i, "1 2 3\n")));
  REQUIRE(writer.commit());
  for (std::uint64_t i = 41; i <= 50; ++i) REQUIRE(writer.add(chunk_row(0, i, "1 2 3\n")));
  // What kill -9 leaves: the file and its -wal as they are now.
  std::filesystem::copy_file(path, crashed);
  std::filesystem::copy_file(path.string() + "-wal", crashed.string() + "-wal");
  auto reader = Reader::open(crashed);
  REQUIRE(reader);
  CHECK(count_chunks(*reader) == 40);
  CHECK(!std::filesystem::exists(crashed.string() + "-wal"));
  REQUIRE(writer.close());
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

TEST_CASE("a file that is no whole log of ours is refused with one sentence") {
  const test::TempFolder dir;
  const auto path = dir.path() / "x.plog";
  SECTION("missing") { CHECK(refusal(path).find("No such file") != std::string::npos); }
  SECTION("a folder") {
    std::filesystem::create_directory(path);
    CHECK(refusal(path) == "is a folder, not a log");
  }
  SECTION("empty") {
    std::ofstream{path};
    CHECK(refusal(path).find("not a device log") != std::string::npos);
  }
  SECTION("text") {
    std::ofstream{path} << std::string(5000, 'x');
    CHECK(refusal(path) == "not a device log (not an SQLite file)");
  }
  SECTION("another database") {
    run_sql(path, "CREATE TABLE chunk(id); INSERT INTO chunk VALUES(1);");
    CHECK(refusal(path).find("not posed's") != std::string::npos);
  }
  SECTION("another table") {
    write_whole_log(path, 3);
    run_sql(path, "DROP TABLE chunk; CREATE TABLE chunk(id, other);");
    CHECK(refusal(path).find("no such column") != std::string::npos);
  }
  SECTION("a newer format") {
    write_whole_log(path, 3);
    run_sql(path, "PRAGMA user_version=3;");
    CHECK(refusal(path).find("update posed") != std::string::npos);
  }
  SECTION("a stream that is not described") {
    write_whole_log(path, 3);
    run_sql(path, "UPDATE chunk SET stream=-1;");
    auto reader = Reader::open(path);
    REQUIRE(reader);
    const auto chunk = reader->next_chunk();
    REQUIRE(!chunk);
    CHECK(chunk.error().message.find("names stream -1 of 2") != std::string::npos);
  }
  SECTION("cut short anywhere, or with pages overwritten: refused or read, never a crash") {
    write_whole_log(path, 60);
    const auto size = std::filesystem::file_size(path);
    std::filesystem::resize_file(path, size / 2);
    CHECK(refusal(path).find("damaged") != std::string::npos);
    for (std::uintmax_t keep = 0; keep < size; keep += size / 37) {
      const auto cut = dir.path() / ("cut" + std::to_string(keep));
      write_whole_log(cut, 60);
      std::filesystem::resize_file(cut, keep);
      CHECK(!refusal(cut).empty());
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
    writer.rollback();
  }
  const auto before = writer.last_chunk_id();
  CHECK(before >= 1);
  REQUIRE(writer.add(chunk_row(0, 200, big)));
  REQUIRE(writer.close());
  auto reader = Reader::open(path);
  REQUIRE(reader);
  CHECK(count_chunks(*reader) == static_cast<std::size_t>(before) + 1);
}
