#include "daemon/record/tape_rings.hpp"

namespace posed::record {
namespace {

std::uint64_t pending(const auto& loss) noexcept {
  return loss.total.load(std::memory_order_relaxed) - loss.carried.load(std::memory_order_relaxed);
}

// After a push: the record took `lost_before` with it, or is itself lost.
void settle(auto& loss, bool fitted, std::uint64_t lost_before) noexcept {
  if (fitted) {
    if (lost_before != 0) loss.carried.fetch_add(lost_before, std::memory_order_relaxed);
  } else {
    loss.total.fetch_add(1, std::memory_order_relaxed);
  }
}

}  // namespace

TapeRings::TapeRings(std::size_t streams, const RingSizes& sizes)
    : chunks_(sizes.chunk_bytes),
      frames_(sizes.frame_bytes),
      decisions_(sizes.decisions),
      wants_published_(sizes.frame_bytes != 0),
      losses_(streams) {}

// RT-safe
void TapeRings::chunk(std::uint32_t stream, std::uint8_t socket, Direction direction,
                      std::int64_t arrival_ns, const pipeline::Position& next,
                      std::span<const std::byte> bytes) noexcept {
  Loss& lost = loss(stream, GapKind::kChunks);
  const ChunkHeader header{.bytes = static_cast<std::uint32_t>(bytes.size()),
                           .stream = stream,
                           .socket = socket,
                           .direction = direction,
                           .arrival_ns = arrival_ns,
                           .next = next,
                           .lost_before = pending(lost)};
  settle(lost, chunks_.push(header, bytes), header.lost_before);
}

// RT-safe
void TapeRings::decision(const pipeline::Decision& decision) noexcept {
  Loss& lost = loss(decision.stream, GapKind::kDecisions);
  const DecisionRecord record{.decision = decision, .lost_before = pending(lost)};
  settle(lost, decisions_.push(record), record.lost_before);
}

// RT-safe
void TapeRings::published(std::uint32_t stream, std::uint64_t sequence, bool raw,
                          std::span<const std::byte> bytes) noexcept {
  Loss& lost = loss(stream, GapKind::kFrames);
  const FrameHeader header{.bytes = static_cast<std::uint32_t>(bytes.size()),
                           .stream = stream,
                           .raw = raw,
                           .sequence = sequence,
                           .lost_before = pending(lost)};
  settle(lost, frames_.push(header, bytes), header.lost_before);
}

// RT-safe
void TapeRings::unpublished(std::uint32_t stream) noexcept {
  if (wants_published_)
    loss(stream, GapKind::kFrames).total.fetch_add(1, std::memory_order_relaxed);
}

void TapeRings::keep_model(std::span<const std::byte> bytes) {
  const std::lock_guard lock(models_mutex_);
  models_.emplace_back(bytes.begin(), bytes.end());
}

std::vector<std::vector<std::byte>> TapeRings::take_models() {
  const std::lock_guard lock(models_mutex_);
  return std::exchange(models_, {});
}

std::uint64_t TapeRings::overflowed(std::uint32_t stream, GapKind kind) const noexcept {
  return losses_[stream][static_cast<std::size_t>(kind)].total.load(std::memory_order_relaxed);
}

std::uint64_t TapeRings::uncarried(std::uint32_t stream, GapKind kind) const noexcept {
  return pending(losses_[stream][static_cast<std::size_t>(kind)]);
}

}  // namespace posed::record
