// Damaged device logs: any flipped bit is detected, or it changes nothing.
#include <catch2/catch.hpp>

#include <fstream>
#include <string>
#include <vector>

#include "proto/log/reader.hpp"
#include "proto/log/writer.hpp"
#include "tests/support/log_surgery.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/proto/log/toy_log.hpp"

namespace posed {
namespace {

using log::Reader;
using log::Writer;
using test::bytes_of;
using test::chunk_row;
using test::forge;
using test::run_sql;
using test::text_of;
using test::writer_with_two_streams;

// The reader's error after reading everything; empty when there is none.
std::string complaint(const std::filesystem::path& path) {
  auto reader = Reader::open(path);
  if (!reader) return reader.error().text();
  for (;;) {
    const auto chunk = reader->next_chunk();
    if (!chunk) return chunk.error().text();
    if (!chunk->has_value()) break;
  }
  if (const auto rows = reader->decisions(); !rows) return rows.error().text();
  if (const auto rows = reader->gaps(); !rows) return rows.error().text();
  if (const auto rows = reader->takes(); !rows) return rows.error().text();
  auto frames = reader->frames(0, false);
  if (!frames) return frames.error().text();
  for (;;) {
    const auto frame = frames->next();
    if (!frame) return frame.error().text();
    if (!frame->has_value()) return {};
  }
}

TEST_CASE("a flipped bit in any column of any row is detected, and log, table and row are named") {
  const test::TempFolder dir;
  const auto whole = dir.path() / "whole.plog", path = dir.path() / "flipped.plog";
  Writer writer = writer_with_two_streams(whole);
  const std::vector<log::StreamPosition> places{{0, 7, 8}};
  for (std::uint64_t i = 1; i <= 3; ++i) {
    log::ChunkRow chunk = chunk_row(0, i, "1 2 3\n");
    chunk.places = places;
    REQUIRE(writer.add(chunk));
    REQUIRE(writer.add(log::DecisionRow{
        .item = i, .stream = 0, .stage = "style", .name = "alpha", .value = "v", .now_ns = 1}));
    REQUIRE(writer.add(log::FrameRow{0, i, false, bytes_of("pose")}));
    REQUIRE(writer.add(log::GapRow{log::GapRow::Kind::kChunks, 0, 2, 11, 99}));
  }
  REQUIRE(writer.close());
  forge(whole, "INSERT INTO take VALUES(2, 'jump', 12, 40, '', 0)");
  CHECK(complaint(whole).empty());
  const auto check = [&](const std::string& table, const std::string& column,
                         const std::string& flipped) {
    std::filesystem::copy_file(whole, path, std::filesystem::copy_options::overwrite_existing);
    const int row = table == "source" || table == "stream" ? 0 : 2;
    run_sql(path, "UPDATE " + table + " SET " + column + "=" + flipped +
                      " WHERE id=" + std::to_string(row));
    const std::string said = complaint(path);
    INFO(table << "." << column << ": " << said);
    CHECK(said.starts_with(path.string() + ": the log is damaged: row " + std::to_string(row) +
                           " of table " + table + " does not match its checksum"));
  };
  for (const char* column : {"name", "driver", "text", "identity", "config"}) {
    check("source", column, std::string(column) + "||'x'");
  }
  for (const char* column : {"body", "name", "stages_json"}) check("stream", column, "'x'");
  for (const char* column : {"source", "first_item"}) {
    check("stream", column, std::string(column) + "+1");
  }
  for (const char* column : {"source", "socket", "direction", "arrival_ns", "first_item"}) {
    check("chunk", column, std::string(column) + "+1");
  }
  for (const char* column : {"sequences", "bytes"}) check("chunk", column, "x'00'");
  for (const char* column : {"item", "stream", "now_ns", "crc"}) {
    check("decision", column, std::string(column) + "+1");
  }
  for (const char* column : {"stage", "name"}) check("decision", column, "'x'");
  check("decision", "value", "x'00'");
  check("frame", "sequence", "sequence+64");
  check("frame", "bytes", "x'00'");
  for (const char* column : {"kind", "owner", "after_chunk", "lost", "time_ns"}) {
    check("gap", column, std::string(column) + "+1");
  }
  check("take", "name", "'x'");
  for (const char* column : {"first_item", "last_item"}) {
    check("take", column, std::string(column) + "+1");
  }
}

// Everything that a replay uses, as the reader returns it.
Result<std::string> contents(const std::filesystem::path& path) {
  auto reader = TRY(Reader::open(path));
  std::string all;
  const auto add = [&](const auto&... parts) { ((all += parts, all += '\n'), ...); };
  for (const auto& row : reader.sources()) add(row.name, row.driver, row.text, row.identity);
  for (const auto& row : reader.streams()) add(row.name, row.stages_json);
  for (;;) {
    const auto chunk = TRY(reader.next_chunk());
    if (!chunk.has_value()) break;
    add(std::to_string(chunk->id), std::to_string(chunk->arrival_ns), text_of(chunk->bytes));
  }
  const auto decisions = TRY(reader.decisions());
  for (const auto& row : decisions) add(std::to_string(row.item), row.stage, row.name, row.value);
  return all;
}

TEST_CASE("any flipped bit of a log is reported or changes nothing") {
  const test::TempFolder dir;
  const auto whole = dir.path() / "whole.plog", path = dir.path() / "flipped.plog";
  Writer writer = writer_with_two_streams(whole);
  for (std::uint64_t i = 1; i <= 200; ++i) {
    const std::string line = "1.5 2.25 " + std::to_string(i) + "\n";
    REQUIRE(writer.add(chunk_row(0, i, line)));
    REQUIRE(writer.add(log::DecisionRow{
        .item = i, .stream = 0, .stage = "style", .name = "alpha", .value = "v", .now_ns = 1}));
  }
  REQUIRE(writer.close());
  const auto expected = contents(whole);
  REQUIRE(expected);
  const auto bits = 8 * std::filesystem::file_size(whole);
  int reported = 0;
  for (std::uintmax_t bit = 0; bit < bits; bit += bits / 400) {
    std::filesystem::copy_file(whole, path, std::filesystem::copy_options::overwrite_existing);
    {
      std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
      const auto at = static_cast<std::streamoff>(bit / 8);
      const int byte = file.seekg(at).get();
      file.seekp(at).put(static_cast<char>(byte ^ (1 << (bit % 8))));
    }
    const auto found = contents(path);
    INFO("bit " << bit);
    if (found) CHECK(*found == *expected);
    if (!found) CHECK(found.error().file == path.string());
    reported += found ? 0 : 1;
  }
  CHECK(reported > 50);  // the other bits are in unused parts of pages
}

}  // namespace
}  // namespace posed
