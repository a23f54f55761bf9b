// Reader of a device log: what the writer wrote, in order, from a file that may be damaged, cut
// short or foreign. One thread; cold.
#pragma once

#include <cstddef>
#include <filesystem>
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

class Reader {
 public:
  // Opens, folds in the -wal that a crash left, and checks the whole file. A file that is no log,
  // of a newer posed, or damaged is refused with one sentence. A log that is being recorded may be
  // read as far as it is committed. Logs of formats 1 and 2 look as if they were of format 3. Each
  // row's checksum is looked at when the row is read; the error of one that does not match names
  // log, table and row.
  [[nodiscard]] static Result<Reader> open(const std::filesystem::path& path);

  Reader(Reader&&) noexcept;
  Reader& operator=(Reader&&) noexcept;
  ~Reader();

  [[nodiscard]] const std::string& file() const;
  [[nodiscard]] const std::map<std::string, std::string>& meta() const;
  [[nodiscard]] const std::vector<SourceRow>& sources() const;  // by id
  [[nodiscard]] const std::vector<StreamRow>& streams() const;  // by id
  [[nodiscard]] const SourceRow& source_of(const StreamRow& stream) const;
  // Where a stream stands in streams(); nothing when the log does not describe it.
  [[nodiscard]] std::optional<std::size_t> place_of_stream(std::uint32_t id) const;
  // Whether items are counted: false for formats 1 and 2.
  [[nodiscard]] bool counts_items() const;

  // The bytes kept under a hash; an error when there are none or they do not match it.
  [[nodiscard]] Result<std::vector<std::byte>> blob(std::string_view sha256) const;

  // The next chunk of all sources in log order; nothing after the last. Its bytes and places are
  // valid until the next call.
  [[nodiscard]] Result<std::optional<ChunkRow>> next_chunk();

  // How much there is to go through: when the first and the last chunk came that a device sent.
  // Nothing when none was logged. Cheap.
  struct Extent {
    std::int64_t first_ns = 0, last_ns = 0;
  };
  [[nodiscard]] Result<std::optional<Extent>> extent() const;

  // Of all streams, in log order.
  [[nodiscard]] Result<std::vector<DecisionRow>> decisions() const;
  [[nodiscard]] Result<std::vector<GapRow>> gaps() const;
  [[nodiscard]] Result<std::vector<TakeRow>> takes() const;

  // The published frames of one stream, raw or styled, in pipeline order. Must not outlive the
  // reader.
  class Frames {
   public:
    Frames(Frames&&) noexcept;
    Frames& operator=(Frames&&) noexcept;
    ~Frames();
    // Nothing after the last; the bytes are valid until the next call.
    [[nodiscard]] Result<std::optional<FrameRow>> next();

   private:
    friend class Reader;
    struct State;
    explicit Frames(std::unique_ptr<State> state);
    std::unique_ptr<State> state_;
  };
  [[nodiscard]] Result<Frames> frames(std::uint32_t stream, bool raw) const;
  [[nodiscard]] Result<bool> has_frames() const;

 private:
  struct State;
  explicit Reader(std::unique_ptr<State> state);

  std::unique_ptr<State> state_;
};

}  // namespace posed::log
