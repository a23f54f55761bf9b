// Reader of a device log: returns the rows in order, from a file that may be damaged, cut short or
// not a log at all. One thread; cold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/result.hpp"
#include "proto/log/rows.hpp"

namespace posed::log {

class Database;

// "the log is damaged: row 17 of table chunk `how`; ..."
[[nodiscard]] std::unexpected<Error> damaged_row(const std::string& file, const char* table,
                                                 std::int64_t id, const std::string& how);

// Fails for a file that Reader::open() refuses by its first bytes: no log, or of a format that this
// posed does not read. Reads nothing else and changes nothing.
Result<> check_format(const std::filesystem::path& path);

class Reader {
 public:
  // Opens the log, merges the -wal file that a crash left, and checks the whole file. A file that
  // is not a log, is from a newer posed, or is damaged is an error. A log that is still being
  // recorded can be read up to its last commit.
  // Each row's checksum is verified when the row is read; the error for a mismatch names log, table
  // and row.
  static Result<Reader> open(const std::filesystem::path& path);

  Reader(Reader&&) noexcept;
  Reader& operator=(Reader&&) noexcept;
  ~Reader();

  [[nodiscard]] const std::string& file() const;
  [[nodiscard]] const std::map<std::string, std::string>& meta() const;
  [[nodiscard]] const std::vector<SourceRow>& sources() const;  // by id
  [[nodiscard]] const std::vector<StreamRow>& streams() const;  // by id
  [[nodiscard]] const SourceRow& source_of(const StreamRow& stream) const;
  // Index of a stream in streams(); empty when the log does not describe it.
  [[nodiscard]] std::optional<std::size_t> place_of_stream(std::uint32_t id) const;

  // The bytes stored under a hash; an error when they are missing or do not match it.
  Result<std::vector<std::byte>> blob(std::string_view sha256) const;

  // The next chunk of all sources in log order; empty after the last. Its bytes and places are
  // valid until the next call.
  Result<std::optional<ChunkRow>> next_chunk();

  // Calls `handle` with each row that describes the bodies of a source, in log order, until it
  // fails. The row is valid during the call, which may not use next_chunk().
  Result<> each_description(const std::function<Result<>(const ChunkRow&)>& handle) const;

  // Arrival times of the first and the last chunk from a device, which bound the length of the log.
  // Empty when none was logged. Cheap.
  struct Extent {
    std::int64_t first_ns = 0, last_ns = 0;
  };
  Result<std::optional<Extent>> extent() const;

  // Decisions of all streams, in log order.
  Result<std::vector<DecisionRow>> decisions() const;
  Result<std::vector<GapRow>> gaps() const;
  Result<std::vector<TakeRow>> takes() const;

  // The published frames of one stream, raw or styled, in pipeline order. Must not outlive the
  // reader.
  class Frames {
   public:
    Frames(Frames&&) noexcept;
    Frames& operator=(Frames&&) noexcept;
    ~Frames();
    // Empty after the last; the bytes are valid until the next call.
    Result<std::optional<FrameRow>> next();

   private:
    friend class Reader;
    struct State;
    explicit Frames(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
  };
  Result<Frames> frames(std::uint32_t stream, bool raw) const;
  Result<bool> has_frames() const;

 private:
  struct State;
  explicit Reader(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace posed::log
