// The rings behind Tape: the hot threads' end puts records in, the recorder thread takes them out.
// What does not fit is counted, and the next record of the same stream that does fit carries the
// count, so that the gap stands in the log where it happened.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include <boost/lockfree/spsc_queue.hpp>

#include "daemon/record/record_ring.hpp"
#include "daemon/record/tape.hpp"
#include "proto/log/rows.hpp"

namespace posed::record {

struct ChunkHeader {
  std::uint32_t bytes = 0;
  std::uint32_t stream = 0;
  std::uint8_t socket = 0;
  Direction direction = Direction::kFromDevice;
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

struct DecisionRecord {
  pipeline::Decision decision;
  std::uint64_t lost_before = 0;
};

struct RingSizes {
  std::size_t chunk_bytes = 0;
  std::size_t frame_bytes = 0;  // 0: published frames are not wanted
  std::size_t decisions = 0;
};

class TapeRings final : public Tape {
 public:
  TapeRings(std::size_t streams, const RingSizes& sizes);

  // Tape, for the hot threads.
  void chunk(std::uint32_t stream, std::uint8_t socket, Direction direction,
             std::int64_t arrival_ns, const pipeline::Position& next,
             std::span<const std::byte> bytes) noexcept override;
  void decision(const pipeline::Decision& decision) noexcept override;
  [[nodiscard]] bool wants_published() const noexcept override { return wants_published_; }
  void published(std::uint32_t stream, std::uint64_t sequence, bool raw,
                 std::span<const std::byte> bytes) noexcept override;
  void unpublished(std::uint32_t stream) noexcept override;
  void keep_model(std::span<const std::byte> bytes) override;

  // The recorder thread's end: each(header, bytes) or each(record) for what is there now.
  template <typename Each>
  void drain_chunks(Each&& each) {
    chunks_.drain(each);
  }
  template <typename Each>
  void drain_frames(Each&& each) {
    frames_.drain(each);
  }
  template <typename Each>
  void drain_decisions(Each&& each) {
    DecisionRecord record;
    for (auto n = decisions_.read_available(); n > 0 && decisions_.pop(record); --n) each(record);
  }
  [[nodiscard]] std::vector<std::vector<std::byte>> take_models();

  using GapKind = log::GapRow::Kind;
  // Records of one kind that did not fit since the start. Any thread.
  [[nodiscard]] std::uint64_t overflowed(std::uint32_t stream, GapKind kind) const noexcept;
  // Those of them that no later record carries; meaningful once the producers have stopped.
  [[nodiscard]] std::uint64_t uncarried(std::uint32_t stream, GapKind kind) const noexcept;
  [[nodiscard]] std::size_t streams() const noexcept { return losses_.size(); }

 private:
  // Carried is written by the one producer of its kind; total by any; both read by any.
  struct Loss {
    std::atomic<std::uint64_t> total{0};
    std::atomic<std::uint64_t> carried{0};
  };
  using Losses = std::array<Loss, 3>;  // by GapKind

  [[nodiscard]] Loss& loss(std::uint32_t stream, GapKind kind) noexcept {
    return losses_[stream][static_cast<std::size_t>(kind)];
  }

  RecordRing<ChunkHeader> chunks_;
  RecordRing<FrameHeader> frames_;
  boost::lockfree::spsc_queue<DecisionRecord> decisions_;
  bool wants_published_ = false;
  std::vector<Losses> losses_;
  std::mutex models_mutex_;
  std::vector<std::vector<std::byte>> models_;
};

}  // namespace posed::record
