// A small device log of two streams, for the tests of its writer and reader.
#pragma once

#include <catch2/catch.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "proto/log/rows.hpp"
#include "proto/log/writer.hpp"
#include "tests/support/file_text.hpp"

namespace posed::test {

inline std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

inline log::SourceRow source_row(std::uint32_t id, const std::string& name) {
  return {id, name, "file", "HIERARCHY\n", "walk.bvh", "{\"path\":\"walk.bvh\"}"};
}

inline log::StreamRow stream_row(std::uint32_t id, std::uint32_t source, const std::string& name) {
  return {id, source, "", name, "{}", 1};
}

// The row points into `text`, which must outlive it.
inline log::ChunkRow chunk_row(std::uint32_t source, std::uint64_t sequence,
                               std::string_view text) {
  return {.source = source,
          .arrival_ns = static_cast<std::int64_t>(sequence) * 1000,
          .first_item = sequence,
          .bytes = bytes_of(text)};
}

inline log::Writer writer_with_two_streams(const std::filesystem::path& path) {
  auto writer = log::Writer::create(path, {.meta = {{"posed_version", "0.1.0"}, {"isa", "avx2"}}});
  REQUIRE(writer);
  for (const std::uint32_t id : {0U, 1U}) {
    REQUIRE(writer->add(source_row(id, id == 0 ? "a" : "b")));
    REQUIRE(writer->add(stream_row(id, id, id == 0 ? "a" : "b")));
  }
  REQUIRE(writer->commit());
  return std::move(*writer);
}

}  // namespace posed::test
