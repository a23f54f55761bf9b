// For tests of the recorder: rings and logs of toy sources, and what a log has of them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

#include "daemon/record/log_writer_loop.hpp"
#include "daemon/record/recorder.hpp"
#include "proto/log/reader.hpp"
#include "tests/support/file_text.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {

using GapKind = log::GapRow::Kind;

inline constexpr std::int64_t kTurn_ns = 50'000'000;

// Of `count` sources with one body each.
inline record::RingSizes ring_sizes_of(std::size_t count, std::size_t chunk_bytes,
                                       const record::SlotSizes& slot) {
  return {.chunk_bytes = std::vector(count, chunk_bytes), .slots = std::vector(count, slot)};
}

// Those of sources with one body each.
inline void add_one_body_streams(record::RecordRings& rings, std::uint32_t count) {
  for (std::uint32_t id = 0; id < count; ++id) {
    rings.add_stream(
        {.id = id, .source = id, .from_start = true, .name = "s" + std::to_string(id)});
  }
}

inline log::SourceRow toy_source(const std::string& name, std::uint32_t id = 0) {
  return {id, name, "file", "", "", "{}"};
}

inline log::Writer make_writer(const std::filesystem::path& path, std::uint32_t sources) {
  auto writer = log::Writer::create(path, {});
  REQUIRE(writer);
  for (std::uint32_t id = 0; id < sources; ++id) {
    REQUIRE(writer->add(toy_source("s" + std::to_string(id), id)));
  }
  REQUIRE(writer->commit());
  return std::move(*writer);
}

// The numbers of the next frame in all chunks of a log, in order, by source; of sources with one
// body.
inline std::vector<std::vector<std::uint64_t>> sequences(const std::filesystem::path& path) {
  auto reader = log::Reader::open(path);
  REQUIRE(reader);
  std::vector<std::vector<std::uint64_t>> found(reader->sources().size());
  for (;;) {
    const auto chunk = reader->next_chunk();
    REQUIRE(chunk);
    if (!chunk->has_value()) return found;
    found[(*chunk)->source].push_back((*chunk)->places[0].next_frame);
  }
}

inline std::vector<log::GapRow> gaps(const std::filesystem::path& path) {
  const auto reader = log::Reader::open(path);
  REQUIRE(reader);
  const auto rows = reader->gaps();
  REQUIRE(rows);
  return *rows;
}

inline std::uint64_t lost(const std::vector<log::GapRow>& rows, std::uint32_t owner, GapKind kind) {
  std::uint64_t sum = 0;
  for (const log::GapRow& row : rows) {
    if (row.owner == owner && row.kind == kind) sum += row.lost;
  }
  return sum;
}

// A chunk of a source with one body, whose stream has the source's number.
inline void put_chunk(pipeline::RecordSink& record_sink, std::uint32_t source,
                      std::uint64_t sequence, const std::string& text) {
  const pipeline::StreamPosition place{.stream = source, .frame = sequence};
  record_sink.chunk(source, 0, pipeline::Direction::kFromDevice,
                    static_cast<std::int64_t>(sequence), {.streams = std::span(&place, 1)},
                    bytes_of(text));
}

// One source of several bodies; `slots` streams may come.
inline record::RingSizes many_bodies(std::size_t chunk_bytes, std::size_t slots,
                                     const record::SlotSizes& slot) {
  return {.chunk_bytes = {chunk_bytes}, .slots = std::vector(slots, slot)};
}

inline record::RecordedStream body_stream(std::uint32_t id, const std::string& body) {
  return {.id = id, .source = 0, .body = body, .name = "mocap-" + body};
}

inline log::Writer writer_of_many(const std::filesystem::path& path) {
  auto writer = log::Writer::create(path, {});
  REQUIRE(writer);
  REQUIRE(writer->add(toy_source("mocap", 0)));
  REQUIRE(writer->commit());
  return std::move(*writer);
}

// A chunk of source 0.
inline void put_bodies(pipeline::RecordSink& record_sink, std::uint64_t item,
                       const std::vector<pipeline::StreamPosition>& streams,
                       std::span<const std::byte> bytes,
                       pipeline::Direction direction = pipeline::Direction::kFromDevice) {
  record_sink.chunk(0, 0, direction, static_cast<std::int64_t>(item),
                    {.item = item, .streams = streams}, bytes);
}

inline std::vector<std::uint32_t> ids_of(const log::Reader& reader) {
  std::vector<std::uint32_t> ids;
  for (const log::StreamRow& stream : reader.streams()) ids.push_back(stream.id);
  return ids;
}

// The recorder without its thread, for one source of several bodies.
struct BodiesRecording {
  explicit BodiesRecording(const record::RingSizes& sizes)
      : rings(sizes), log_writer(rings, writer_of_many(path), path, [&](const auto& event) {
          events.push_back(event);
        }) {}
  void turn() { log_writer.turn(now_ns += kTurn_ns); }
  void finish() { REQUIRE(log_writer.finish(now_ns += kTurn_ns)); }

  TempFolder dir;
  std::filesystem::path path = dir.path() / "a.plog";
  std::vector<record::RecorderEvent> events;
  std::int64_t now_ns = 0;
  record::RecordRings rings;
  record::LogWriterLoop log_writer;
};

}  // namespace posed::test
