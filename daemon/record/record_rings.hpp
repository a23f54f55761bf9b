// The rings behind RecordSink: the hot threads add records, the recorder thread removes them. Each
// stream has a share of every ring, so that no stream can cause another to lose records. A record
// that does not fit is counted, and the next record of the same stream that fits carries the count;
// so the gap row stands in the log where the gap happened.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <mutex>
#include <span>
#include <vector>

#include <boost/lockfree/spsc_queue.hpp>

#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/record/record_ring.hpp"
#include "proto/log/rows.hpp"

namespace posed::record {

struct ChunkHeader {
  std::uint32_t bytes = 0;
  std::uint32_t stream = 0;
  std::uint8_t socket = 0;
  pipeline::Direction direction = pipeline::Direction::kFromDevice;
  std::int64_t arrival_ns = 0;
  pipeline::Position next{};
  std::uint64_t lost_before = 0;
};

struct FrameHeader {
  std::uint32_t bytes = 0;
  std::uint32_t stream = 0;
  bool raw = false;
  std::uint64_t sequence = 0;
  std::uint64_t lost_before = 0;
};

// Stands for "no frame"; compares as later than any frame.
inline constexpr std::uint64_t kNoFrame = std::numeric_limits<std::uint64_t>::max();

// The first frame of its stream that a decision concerns. RT-safe.
[[nodiscard]] inline std::uint64_t first_frame_of(const pipeline::Decision& decision) noexcept {
  const bool of_samples = decision.kind == pipeline::Decision::Kind::kShedSamples;
  return of_samples ? kNoFrame : decision.sequence;
}

struct DecisionRecord {
  pipeline::Decision decision;
  std::uint64_t lost_before = 0;
  std::uint64_t lost_from_frame = 0;  // the first frame that one of the lost decisions may concern
};

// How much of the rings one stream may use.
struct RingSizes {
  std::size_t chunk_bytes = 0;
  std::size_t frame_bytes = 0;  // 0: published frames are not recorded
  std::size_t decisions = 0;
};

class RecordRings final : public pipeline::RecordSink {
 public:
  // A share for each stream, in stream order. Frames are recorded of all streams or of none.
  explicit RecordRings(const std::vector<RingSizes>& shares);

  // RecordSink, called by the hot threads.
  void chunk(std::uint32_t stream, std::uint8_t socket, pipeline::Direction direction,
             std::int64_t arrival_ns, const pipeline::Position& next,
             std::span<const std::byte> bytes) noexcept override;
  void decision(const pipeline::Decision& decision) noexcept override;
  [[nodiscard]] bool wants_published() const noexcept override { return wants_published_; }
  void published(std::uint32_t stream, std::uint64_t sequence, bool raw,
                 std::span<const std::byte> bytes) noexcept override;
  void unpublished(std::uint32_t stream) noexcept override;
  void keep_model(std::span<const std::byte> bytes) override;

  // Called by the recorder thread: each(header, bytes) or each(record) for what is there now.
  template <typename Each>
  void drain_chunks(Each&& each) {
    chunks_.drain([&](const ChunkHeader& header, std::span<const std::byte> bytes) {
      give_back(header.stream, GapKind::kChunks, chunks_.size_of(header));
      each(header, bytes);
    });
  }
  template <typename Each>
  void drain_frames(Each&& each) {
    frames_.drain([&](const FrameHeader& header, std::span<const std::byte> bytes) {
      give_back(header.stream, GapKind::kFrames, frames_.size_of(header));
      each(header, bytes);
    });
  }
  template <typename Each>
  void drain_decisions(Each&& each) {
    DecisionRecord record;
    for (auto n = decisions_.read_available(); n > 0 && decisions_.pop(record); --n) {
      give_back(record.decision.stream, GapKind::kDecisions, 1);
      each(record);
    }
  }
  [[nodiscard]] std::vector<std::vector<std::byte>> take_models();

  using GapKind = log::GapRow::Kind;
  // Records of one kind that did not fit since the start. Any thread.
  [[nodiscard]] std::uint64_t overflowed(std::uint32_t stream, GapKind kind) const noexcept;
  // How many of them no later record carries; valid once the producers have stopped.
  [[nodiscard]] std::uint64_t uncarried(std::uint32_t stream, GapKind kind) const noexcept;
  // The first frame that may be concerned by a lost decision that no later one carries.
  [[nodiscard]] std::uint64_t uncarried_from_frame(std::uint32_t stream) const noexcept;
  [[nodiscard]] std::size_t streams() const noexcept { return shares_.size(); }

 private:
  // One stream's part of one ring. `share`, `carried` and `lost_from_frame` are written by the
  // single producer of this kind, `total` by any thread, `taken` by the recorder. Any thread may
  // read all of them except `share`.
  struct StreamShare {
    explicit StreamShare(std::size_t size) noexcept : share(size, taken) {}
    std::atomic<std::uint64_t> taken{0};
    pipeline::RingShare share;
    std::atomic<std::uint64_t> total{0};            // records that did not fit
    std::atomic<std::uint64_t> carried{0};          // how many of them a later record has reported
    std::atomic<std::uint64_t> lost_from_frame{0};  // for decisions, see DecisionRecord
  };
  struct StreamShares {
    explicit StreamShares(const RingSizes& sizes) noexcept
        : by_kind{StreamShare(sizes.chunk_bytes), StreamShare(sizes.decisions),
                  StreamShare(sizes.frame_bytes)} {}
    std::array<StreamShare, 3> by_kind;  // by GapKind
  };

  [[nodiscard]] StreamShare& share_of(std::uint32_t stream, GapKind kind) noexcept {
    return shares_[stream].by_kind[static_cast<std::size_t>(kind)];
  }
  [[nodiscard]] const StreamShare& share_of(std::uint32_t stream, GapKind kind) const noexcept {
    return shares_[stream].by_kind[static_cast<std::size_t>(kind)];
  }
  void give_back(std::uint32_t stream, GapKind kind, std::size_t amount) noexcept {
    share_of(stream, kind).taken.fetch_add(amount, std::memory_order_release);
  }

  RecordRing<ChunkHeader> chunks_;
  RecordRing<FrameHeader> frames_;
  boost::lockfree::spsc_queue<DecisionRecord> decisions_;
  bool wants_published_ = false;
  std::deque<StreamShares> shares_;  // by stream
  std::mutex models_mutex_;
  std::vector<std::vector<std::byte>> models_;
};

}  // namespace posed::record
