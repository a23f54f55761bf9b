// LogWriterLoop: the work of the recorder thread in each turn. It empties the rings into the log
// and commits. On an error (such as a full disk) it counts what is lost, reports the error once,
// and tries again from time to time until writing works. It has no thread and no clock, so tests
// can drive it.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/record/record_rings.hpp"
#include "daemon/record/recorded_stream.hpp"
#include "proto/log/writer.hpp"

namespace posed::record {

// An event of the recorder that a person should know about.
struct RecorderEvent {
  enum class Kind : std::uint8_t { kGap, kError, kTake };
  Kind kind = Kind::kGap;
  // Which it concerns: those that a source has now if it lacks chunks; all of them for an error and
  // for a take.
  std::vector<std::uint32_t> streams;
  std::int64_t time_ns = 0;
  std::string text;
  std::optional<log::TakeRow> take{};  // of kTake: as the log gets it
};

class LogWriterLoop {
 public:
  // Calls `report` from within turn() and finish(). The rings must outlive this object. A writer
  // that is not open is opened by the first turn that can.
  LogWriterLoop(RecordRings& rings, log::Writer writer, std::filesystem::path path,
                std::function<void(const RecorderEvent&)> report);

  // Call every 50 to 100 ms; commits when 250 ms have passed since the last commit.
  void turn(std::int64_t now_ns);
  // Call after the producers have stopped: writes the rest and leaves a single file.
  Result<> finish(std::int64_t now_ns);

  // Any thread. The number of chunks missing in the log, of published frames that it should have,
  // and of failed attempts to write.
  [[nodiscard]] std::uint64_t lost_chunks() const noexcept;
  [[nodiscard]] std::uint64_t lost_frames() const noexcept { return lost_frames_.load(); }
  [[nodiscard]] std::uint64_t errors() const noexcept { return errors_.load(); }
  // When the last of these attempts was; kNoTime_ns: there was none.
  [[nodiscard]] std::int64_t error_ns() const noexcept { return error_ns_.load(); }

 private:
  using GapKind = log::GapRow::Kind;

  // The rows of one kind of one owner: chunks belong to a source, the others to a stream.
  struct Tally {
    GapKind kind = GapKind::kChunks;
    std::uint32_t owner = 0;
    std::uint32_t source = 0;
    const Losses* in_rings = nullptr;
    std::uint64_t uncommitted = 0;  // rows added since the last commit
    std::uint64_t in_gaps = 0;      // records counted in the gap rows added since then
    std::uint64_t lost = 0;         // lost and not in a gap row yet
    std::uint64_t reported = 0;     // overflows already reported
    // Of decisions: the first frame that is concerned by one, or by a gap row, added since the last
    // commit; and by one that is lost and not in a gap row yet.
    std::uint64_t uncommitted_from_frame = kNoFrame;
    std::uint64_t lost_from_frame = kNoFrame;
  };
  struct SourceState {
    Tally chunks;
    std::vector<std::uint32_t> streams;  // that it has, as of its last chunk
    std::int64_t last_chunk = 0;
    std::int64_t committed_chunk = 0;
  };
  struct StreamState {
    Tally decisions, frames;
    std::optional<RecordedStream> row;  // until it is committed
    bool named = false;                 // by a record, so that the log needs the row
    std::uint64_t first_item = 0;       // of the records that name it; 0: unknown
  };

  void drain(std::int64_t now_ns);
  // Adds a row, or counts it as lost while writing fails.
  template <typename Row>
  bool put(Tally& tally, const Row& row, std::int64_t now_ns);
  void put_chunk(const ChunkHeader& header, std::span<const pipeline::StreamPosition> positions,
                 std::span<const std::byte> bytes, std::int64_t now_ns);
  void put_decision(const DecisionRecord& record, std::int64_t now_ns);
  void put_frame(const FrameHeader& header, std::span<const std::byte> bytes, std::int64_t now_ns);
  // `from_frame`: the first frame that the lost decisions may concern.
  void put_gap(Tally& tally, std::uint64_t lost, std::int64_t now_ns,
               std::uint64_t from_frame = kNoFrame);
  Result<log::GapRow> gap_row(const Tally& tally, std::uint64_t lost, std::int64_t now_ns,
                              std::uint64_t from_frame) const;
  void add_streams();
  void add_takes();
  [[nodiscard]] std::vector<std::uint32_t> streams_now() const;
  void add_stream(RecordedStream row);
  // The state of a stream that a record names; null if it was never added. `item`: from which on
  // the record proves that the stream is there; 0: it does not say.
  StreamState* meet(std::uint32_t id, std::uint64_t item);
  Result<> write_stream_rows();
  Result<> write_lost(std::int64_t now_ns);
  Result<> commit(std::int64_t now_ns);
  void count_lost(Tally& tally, std::uint64_t count);
  void fail(const Error& error, std::int64_t now_ns);
  void failed(const Error& error, std::int64_t now_ns);
  void resume(std::int64_t now_ns);
  void report_overflows(std::int64_t now_ns);
  void report_gap(const Tally& tally, std::int64_t now_ns, const std::string& text);
  template <typename Each>
  void each_tally(Each&& each) {
    for (SourceState& source : sources_) each(source.chunks);
    for (auto& [id, stream] : streams_) {
      each(stream.decisions);
      each(stream.frames);
    }
  }

  RecordRings& rings_;
  log::Writer writer_;   // closed while writing fails
  std::string trouble_;  // why writing fails
  std::filesystem::path path_;
  std::function<void(const RecorderEvent&)> report_;
  std::vector<SourceState> sources_;              // by number
  std::map<std::uint32_t, StreamState> streams_;  // by id
  std::vector<log::StreamPosition> places_;       // of the chunk that is written
  std::vector<std::vector<std::byte>> models_;    // not yet committed
  std::map<std::int64_t, log::TakeRow> takes_;    // by number; those not yet committed as they are
  std::int64_t last_commit_ns_ = 0;
  std::int64_t retry_ns_ = 0;        // when to try again
  std::int64_t retry_after_ns_ = 0;  // grows while attempts fail
  std::int64_t resumed_ns_ = kNoTime_ns / 2;
  std::atomic<std::uint64_t> errors_{0};
  std::atomic<std::int64_t> error_ns_{kNoTime_ns};
  std::atomic<std::uint64_t> lost_to_errors_{0}, lost_frames_{0};
};

}  // namespace posed::record
