// Writer of a device log. Rows are collected in a transaction until commit(); a crash loses only
// what was not committed. A log's name is taken with an empty file that nobody else can make, so no
// two writers share one. Not thread-safe; starts no threads; cold.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"

namespace posed::log {

// Makes an empty file for a log that a Writer then begins. kTaken: there is a file of this name, or
// one that SQLite would read with it; nothing was changed. kNoRoom: the disk is full.
enum class Reserved : std::uint8_t { kYes, kTaken, kNoRoom };
Result<Reserved> reserve(const std::filesystem::path& path);

// What a log holds from its first moment on, and whose it is: a writer goes on only with a log that
// has the same `meta`.
struct Beginning {
  std::map<std::string, std::string> meta{};
  std::vector<SourceRow> sources{};
};

class Writer {
 public:
  // A log that resume() begins. `reserved`: reserve() has made its file.
  Writer(std::filesystem::path path, Beginning beginning, bool reserved);
  // Begins a log where there is none; otherwise it fails.
  static Result<Writer> create(const std::filesystem::path& path, Beginning beginning);

  Writer(Writer&&) noexcept;
  Writer& operator=(Writer&&) noexcept;
  // Removes the file of a log of which nothing was committed after its beginning.
  ~Writer();

  // Opens the log: begins it, or after interrupt() continues it. The other functions, except
  // is_open() and last_chunk_id(), need it to be open.
  Result<> resume();
  // Call it after an error: discards the rows since the last commit and closes the file, because
  // only a new connection is known to be in a valid state.
  void interrupt();
  [[nodiscard]] bool is_open() const;
  // False when the log was deleted, moved, replaced or cut short, so that what is written would be
  // lost.
  [[nodiscard]] bool is_in_place() const;

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

  [[nodiscard]] std::int64_t last_chunk_id() const;  // 0 before the first, and while closed
  // Id of the source's last chunk before the chunk that contains this frame of its stream; 0 when
  // there is none. Searches from the end of the log.
  Result<std::int64_t> chunk_before_frame(std::uint32_t source, std::uint32_t stream,
                                          std::uint64_t frame) const;

  // Makes all rows so far survive kill -9 and power loss.
  Result<> commit();
  // Commits, and leaves one file without -wal. An error if not all that was committed can be read
  // back; a log of more than 1 GiB is not read for that, except for its last rows.
  Result<> close();

 private:
  struct Connection;
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace posed::log
