// LogWriterLoop: the work of the recorder thread in each turn. It empties the rings into the log
// and commits. On an error (such as a full disk) it counts what is lost, reports the error once,
// and tries again from time to time until writing works. It has no thread and no clock, so tests
// can drive it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/record/record_rings.hpp"
#include "proto/log/writer.hpp"

namespace posed::record {

// An event of the recorder that a person should know about.
struct RecorderEvent {
  enum class Kind : std::uint8_t { kGap, kError };
  Kind kind = Kind::kGap;
  std::uint32_t stream = 0;  // of a gap; an error concerns all streams
  std::int64_t time_ns = 0;
  std::string text;
};

class LogWriterLoop {
 public:
  // Calls `report` from within turn() and finish(). The rings must outlive this object.
  LogWriterLoop(RecordRings& rings, log::Writer writer, std::filesystem::path path,
                std::function<void(const RecorderEvent&)> report);

  // Call every 50 to 100 ms; commits when 250 ms have passed since the last commit.
  void turn(std::int64_t now_ns);
  // Call after the producers have stopped: writes the rest and leaves a single file.
  [[nodiscard]] Result<> finish(std::int64_t now_ns);

  // Any thread. The number of chunks missing in the log, and of failed attempts to write.
  [[nodiscard]] std::uint64_t lost_chunks() const noexcept;
  [[nodiscard]] std::uint64_t errors() const noexcept { return errors_.load(); }

 private:
  using GapKind = log::GapRow::Kind;
  static constexpr std::array kKinds{GapKind::kChunks, GapKind::kDecisions, GapKind::kFrames};
  using Counts = std::array<std::uint64_t, kKinds.size()>;  // by GapKind

  struct StreamState {
    Counts uncommitted{};  // rows added since the last commit
    Counts in_gaps{};      // records counted in the gap rows added since then
    Counts lost{};         // lost and not in a gap row yet
    Counts reported{};     // overflows already reported
    // The first frame that is concerned by a decision or a gap row added since the last commit; and
    // by a decision that is lost and not in a gap row yet.
    std::uint64_t uncommitted_from_frame = kNoFrame;
    std::uint64_t lost_from_frame = kNoFrame;
    std::int64_t last_chunk = 0;
    std::int64_t committed_chunk = 0;
  };

  [[nodiscard]] static std::size_t index(GapKind kind) { return static_cast<std::size_t>(kind); }
  void drain(std::int64_t now_ns);
  // Adds a row of a stream, or counts it as lost while writing fails.
  template <typename Row>
  bool put(std::uint32_t stream, GapKind kind, const Row& row, std::int64_t now_ns);
  void put_decision(const DecisionRecord& record, std::int64_t now_ns);
  // `from_frame`: the first frame that the lost decisions may concern.
  void put_gap(std::uint32_t stream, GapKind kind, std::uint64_t lost, std::int64_t now_ns,
               std::uint64_t from_frame = kNoFrame);
  [[nodiscard]] Result<log::GapRow> gap_row(std::uint32_t stream, GapKind kind, std::uint64_t lost,
                                            std::int64_t now_ns, std::uint64_t from_frame) const;
  [[nodiscard]] Result<> write_lost(std::int64_t now_ns);
  [[nodiscard]] Result<> commit(std::int64_t now_ns);
  void count_lost(std::uint32_t stream, GapKind kind, std::uint64_t count);
  void fail(const Error& error, std::int64_t now_ns);
  void resume(std::int64_t now_ns);
  void report_overflows(std::int64_t now_ns);

  RecordRings& rings_;
  std::optional<log::Writer> writer_;  // empty while writing fails
  std::filesystem::path path_;
  std::function<void(const RecorderEvent&)> report_;
  std::vector<StreamState> streams_;
  std::vector<std::vector<std::byte>> models_;  // not yet committed
  std::int64_t last_commit_ns_ = 0;
  std::int64_t retry_ns_ = 0;        // when to try again
  std::int64_t retry_after_ns_ = 0;  // grows while attempts fail
  std::int64_t resumed_ns_ = kNoTime_ns / 2;
  std::atomic<std::uint64_t> errors_{0};
  std::atomic<std::uint64_t> lost_to_errors_{0};
};

}  // namespace posed::record
