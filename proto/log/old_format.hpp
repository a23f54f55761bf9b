// Presents formats 1 and 2 of the device log as rows of format 3: each old stream becomes a source
// with one body. Those formats counted neither items nor samples, and their rows have no checksum.
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

// Statements that select the rows in order, and functions that convert the columns to rows.
[[nodiscard]] Result<Statement> select_chunks(Database& database);
[[nodiscard]] ChunkRow chunk(const Statement& row, std::vector<StreamPosition>& places);

[[nodiscard]] Result<Statement> select_decisions(Database& database);
// An invalid kind or label list becomes a row that its reader rejects.
[[nodiscard]] DecisionRow decision(const Statement& row);

[[nodiscard]] Result<Statement> select_gaps(Database& database);
[[nodiscard]] GapRow gap(const Statement& row);

// Selects the raw or styled frames of one stream: the same columns as in format 3.
inline constexpr const char* kSelectFrames =
    "SELECT id, stream, sequence, raw, bytes FROM frame WHERE stream=? AND raw=? ORDER BY id";

}  // namespace posed::log::old_format
