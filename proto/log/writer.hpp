// Writer of a device log. Rows are collected in a transaction until commit(); a crash loses only
// what was not committed. Not thread-safe; starts no threads; cold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"

namespace posed::log {

class Database;

class Writer {
 public:
  // Creates the file with all tables and `meta`, committed. Fails if the file exists, unless
  // `overwrite` is set.
  static Result<Writer> create(const std::filesystem::path& path,
                               const std::map<std::string, std::string>& meta, bool overwrite);
  // Continues a log that create() made and that an error interrupted.
  static Result<Writer> reopen(const std::filesystem::path& path);

  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;
  ~Writer();

  // Chunks, decisions, frames and gaps get the next id of their table; the id in the row is
  // ignored. A row of a stream that is there already is replaced, because a failed commit may have
  // kept it. A row of a take is replaced, too: it is written when the take begins and when it ends.
  // Each source and stream that a row refers to must be added before the same commit.
  Result<> add(const SourceRow& row);
  Result<> add(const StreamRow& row);
  Result<> add(const ChunkRow& row);
  Result<> add(const DecisionRow& row);
  Result<> add(const FrameRow& row);
  Result<> add(const GapRow& row);
  Result<> add(const TakeRow& row);
  // Stores the bytes once, even if added again; returns their SHA-256.
  Result<std::string> add_blob(std::span<const std::byte> bytes);

  [[nodiscard]] std::int64_t last_chunk_id() const;  // 0 before the first
  // Id of the source's last chunk before the chunk that contains this frame of its stream; 0 when
  // there is none. Searches from the end of the log.
  Result<std::int64_t> chunk_before_frame(std::uint32_t source, std::uint32_t stream,
                                          std::uint64_t frame) const;

  // Makes all rows so far survive kill -9 and power loss.
  Result<> commit();
  // Call it after an error: discards the rows since the last commit, so that writing may continue.
  void rollback();
  // Commits, and leaves one file without -wal.
  Result<> close();

 private:
  struct State;
  explicit Writer(std::unique_ptr<State> state);
  static Result<Writer> on(Database database);

  std::unique_ptr<State> state_;
};

}  // namespace posed::log
