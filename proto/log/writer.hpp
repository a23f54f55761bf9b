// Writer of a device log. Rows gather in a transaction until commit(); a crash loses what was not
// committed and nothing else. One thread; cold; no threads of its own.
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
  // Makes the file with all its tables and `meta`, committed. An existing file is refused unless
  // `overwrite`.
  [[nodiscard]] static Result<Writer> create(const std::filesystem::path& path,
                                             const std::map<std::string, std::string>& meta,
                                             bool overwrite);
  // Goes on writing a log that create() made and that an error interrupted.
  [[nodiscard]] static Result<Writer> reopen(const std::filesystem::path& path);

  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;
  ~Writer();

  // Chunks, decisions, frames and gaps get the next id of their table; the row's own is not read.
  // A source comes before its streams, a stream before what speaks of it.
  [[nodiscard]] Result<> add(const SourceRow& row);
  [[nodiscard]] Result<> add(const StreamRow& row);
  [[nodiscard]] Result<> add(const ChunkRow& row);
  [[nodiscard]] Result<> add(const DecisionRow& row);
  [[nodiscard]] Result<> add(const FrameRow& row);
  [[nodiscard]] Result<> add(const GapRow& row);
  // Keeps the bytes once, whoever adds them again; returns their SHA-256.
  [[nodiscard]] Result<std::string> add_blob(std::span<const std::byte> bytes);

  [[nodiscard]] std::int64_t last_chunk_id() const;  // 0 before the first
  // The chunk of the source that comes before the one with this frame of its stream; 0 when there
  // is none. Searches from the end of the log.
  [[nodiscard]] Result<std::int64_t> chunk_before_frame(std::uint32_t source, std::uint32_t stream,
                                                        std::uint64_t frame) const;

  // Makes everything so far survive kill -9 and power loss.
  [[nodiscard]] Result<> commit();
  // After an error: forgets what was added since the last commit, so that writing may go on.
  void rollback();
  // Commits and leaves one file without -wal.
  [[nodiscard]] Result<> close();

 private:
  struct State;
  explicit Writer(std::unique_ptr<State> state);
  static Result<Writer> on(Database database);

  std::unique_ptr<State> state_;
};

}  // namespace posed::log
