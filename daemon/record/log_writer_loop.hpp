// LogWriterLoop: what the recorder thread does at each turn. Empties the rings into the log,
// commits, and on an error (a full disk) counts what is lost, tells it once, and tries again now
// and then until writing works. No thread and no clock of its own, so tests drive it.
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

// Something about recording that a person should know.
struct RecorderEvent {
  enum class Kind : std::uint8_t { kGap, kError };
  Kind kind = Kind::kGap;
  std::uint32_t stream = 0;  // of a gap; an error concerns all streams
  std::int64_t time_ns = 0;
  std::string text;
};

class LogWriterLoop {
 public:
  // `tell` is called from within turn() and finish(). The rings must outlive the log_writer.
  LogWriterLoop(RecordRings& rings, log::Writer writer, std::filesystem::path path,
                std::function<void(const RecorderEvent&)> report);

  // Call every 50 to 100 ms; commits when 250 ms have passed since the last commit.
  void turn(std::int64_t now_ns);
  // After the producers have stopped: writes the rest and leaves one file.
  [[nodiscard]] Result<> finish(std::int64_t now_ns);

  // Any thread. Chunks missing in the log, and failed attempts to write.
  [[nodiscard]] std::uint64_t lost_chunks() const noexcept;
  [[nodiscard]] std::uint64_t errors() const noexcept { return errors_.load(); }

 private:
  using GapKind = log::GapRow::Kind;
  static constexpr std::array kKinds{GapKind::kChunks, GapKind::kDecisions, GapKind::kFrames};
  using Counts = std::array<std::uint64_t, kKinds.size()>;  // by GapKind

  struct StreamState {
    Counts uncommitted{};  // rows added since the last commit
    Counts in_gaps{};      // what gap rows since then speak of
    Counts lost{};         // in no gap row yet
    Counts reported{};     // overflows already told
    // The first frame that a decision concerns which was added, or told of in a gap row, since the
    // last commit; which is lost and in no gap row yet.
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
  // `from_frame`: the first that the lost decisions may concern.
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
  std::optional<log::Writer> writer_;  // nothing while writing fails
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
