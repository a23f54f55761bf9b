// Formats 1 and 2 of the device log, presented as rows of format 3: each old stream is a source
// with one body. They counted neither items nor samples, and their rows carry no checksum.
#pragma once

#include <string>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/log/database.hpp"
#include "proto/log/rows.hpp"

namespace posed::log::old_format {

struct Streams {
  std::vector<SourceRow> sources;
  std::vector<StreamRow> streams;
};
[[nodiscard]] Result<Streams> read_streams(Database& database, const std::string& file);

// Statements for the rows in their order, and the rows that their columns stand for.
[[nodiscard]] Result<Statement> select_chunks(Database& database);
[[nodiscard]] ChunkRow chunk(const Statement& row, std::vector<StreamPlace>& places);

[[nodiscard]] Result<Statement> select_decisions(Database& database);
// A kind or labels that no pipeline wrote become a row that makes no sense to whoever reads it.
[[nodiscard]] DecisionRow decision(const Statement& row);

[[nodiscard]] Result<Statement> select_gaps(Database& database);
[[nodiscard]] GapRow gap(const Statement& row);

// Of one stream, raw or styled: the same columns as in format 3.
inline constexpr const char* kSelectFrames =
    "SELECT id, stream, sequence, raw, bytes FROM frame WHERE stream=? AND raw=? ORDER BY id";

}  // namespace posed::log::old_format
