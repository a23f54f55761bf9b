#include "daemon/record/record_rings.hpp"

#include <algorithm>

namespace posed::record {
namespace {

constexpr auto kRelaxed = std::memory_order_relaxed;

std::uint64_t pending(const auto& to) noexcept {
  return to.total.load(kRelaxed) - to.carried.load(kRelaxed);
}

// Adds a record to its stream's share with `push`. A record that fits carries `lost_before`;
// otherwise it is itself counted as lost, and the result is false.
bool put(auto& to, std::size_t amount, std::uint64_t lost_before, auto&& push) noexcept {
  if (to.share.has_room(amount) && push()) {
    to.share.add(amount);
    if (lost_before != 0) to.carried.fetch_add(lost_before, kRelaxed);
    return true;
  }
  to.total.fetch_add(1, kRelaxed);
  return false;
}

std::size_t sum_of(const std::vector<RingSizes>& shares, std::size_t RingSizes::* size) {
  std::size_t sum = 0;
  for (const RingSizes& share : shares) sum += share.*size;
  return sum;
}

}  // namespace

RecordRings::RecordRings(const std::vector<RingSizes>& shares)
    : chunks_(sum_of(shares, &RingSizes::chunk_bytes)),
      frames_(sum_of(shares, &RingSizes::frame_bytes)),
      decisions_(sum_of(shares, &RingSizes::decisions)),
      wants_published_(sum_of(shares, &RingSizes::frame_bytes) != 0) {
  for (const RingSizes& share : shares) shares_.emplace_back(share);
}

// RT-safe
void RecordRings::chunk(std::uint32_t stream, std::uint8_t socket, pipeline::Direction direction,
                        std::int64_t arrival_ns, const pipeline::Position& next,
                        std::span<const std::byte> bytes) noexcept {
  StreamShare& to = share_of(stream, GapKind::kChunks);
  const ChunkHeader header{.bytes = static_cast<std::uint32_t>(bytes.size()),
                           .stream = stream,
                           .socket = socket,
                           .direction = direction,
                           .arrival_ns = arrival_ns,
                           .next = next,
                           .lost_before = pending(to)};
  put(to, chunks_.size_of(header), header.lost_before, [&] { return chunks_.push(header, bytes); });
}

// RT-safe
void RecordRings::decision(const pipeline::Decision& decision) noexcept {
  StreamShare& to = share_of(decision.stream, GapKind::kDecisions);
  const DecisionRecord record{.decision = decision,
                              .lost_before = pending(to),
                              .lost_from_frame = to.lost_from_frame.load(kRelaxed)};
  if (put(to, 1, record.lost_before, [&] { return decisions_.push(record); })) return;
  const std::uint64_t before = record.lost_before == 0 ? kNoFrame : record.lost_from_frame;
  to.lost_from_frame.store(std::min(before, first_frame_of(decision)), kRelaxed);
}

// RT-safe
void RecordRings::published(std::uint32_t stream, std::uint64_t sequence, bool raw,
                            std::span<const std::byte> bytes) noexcept {
  StreamShare& to = share_of(stream, GapKind::kFrames);
  const FrameHeader header{.bytes = static_cast<std::uint32_t>(bytes.size()),
                           .stream = stream,
                           .raw = raw,
                           .sequence = sequence,
                           .lost_before = pending(to)};
  put(to, frames_.size_of(header), header.lost_before, [&] { return frames_.push(header, bytes); });
}

// RT-safe
void RecordRings::unpublished(std::uint32_t stream) noexcept {
  if (wants_published_) share_of(stream, GapKind::kFrames).total.fetch_add(1, kRelaxed);
}

void RecordRings::keep_model(std::span<const std::byte> bytes) {
  const std::lock_guard lock(models_mutex_);
  models_.emplace_back(bytes.begin(), bytes.end());
}

std::vector<std::vector<std::byte>> RecordRings::take_models() {
  const std::lock_guard lock(models_mutex_);
  return std::exchange(models_, {});
}

std::uint64_t RecordRings::overflowed(std::uint32_t stream, GapKind kind) const noexcept {
  return share_of(stream, kind).total.load(kRelaxed);
}

std::uint64_t RecordRings::uncarried(std::uint32_t stream, GapKind kind) const noexcept {
  return pending(share_of(stream, kind));
}

std::uint64_t RecordRings::uncarried_from_frame(std::uint32_t stream) const noexcept {
  return share_of(stream, GapKind::kDecisions).lost_from_frame.load(kRelaxed);
}

}  // namespace posed::record
