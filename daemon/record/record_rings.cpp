#include "daemon/record/record_rings.hpp"

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frame/time.hpp"
#include "proto/log/digest.hpp"

namespace posed::record {
namespace {

std::string with_remark(const std::string& sentence, const std::string& remark) {
  return remark.empty() ? sentence : sentence + "; " + remark;
}

constexpr auto kRelaxed = std::memory_order_relaxed;

std::size_t sum_of(const std::vector<SlotSizes>& slots, std::size_t SlotSizes::* size) {
  std::size_t sum = 0;
  for (const SlotSizes& slot : slots) sum += slot.*size;
  return sum;
}

// Adds a record to its share of a ring with `push`. A record that fits carries `lost_before`;
// otherwise it is itself counted as lost, and the result is false.
RT_SAFE bool put(auto& share, Losses& lost, std::size_t amount, std::uint64_t lost_before,
                 auto&& push) noexcept {
  if (share.share.has_room(amount) && push()) {
    share.share.add(amount);
    pipeline::count(share.put, amount);
    if (lost_before != 0) lost.carried.fetch_add(lost_before, kRelaxed);
    return true;
  }
  lost.total.fetch_add(1, kRelaxed);
  return false;
}

}  // namespace

Result<pipeline::Take> Takes::mark(const pipeline::TakeMark& mark, std::uint64_t next_item) {
  const std::scoped_lock lock(mutex_);
  if (!mark.start && !running_) return fail("no take is running, so there is none to end");
  if (mark.start && last_number_ == kMaxTakes) {
    return fail("this recording has " + std::to_string(kMaxTakes) +
                " takes already; begin another recording");
  }
  std::optional<pipeline::Take> marked;
  if (running_) {
    marked = as_of_now();
    end(mark, next_item);
  }
  if (mark.start) {
    begin(mark, next_item);
    marked = as_of_now();
  }
  return *marked;
}

pipeline::Take Takes::as_of_now() const {
  pipeline::Take take = *running_;
  take.lost_chunks = state_.lost_chunks - lost_before_;
  take.trouble = state_.trouble;
  return take;
}

void Takes::end(const pipeline::TakeMark& mark, std::uint64_t next_item) {
  const pipeline::Take take = as_of_now();
  running_.reset();
  std::string sentence = fmt::format("{} has ended after {:.1f} s", pipeline::words_of(take),
                                     seconds(mark.time_ns - take.start_ns));
  if (take.lost_chunks > 0) {
    sentence += fmt::format("; meanwhile the log lost {} chunks", take.lost_chunks);
  }
  if (!mark.start) sentence = with_remark(sentence, mark.remark);
  changes_.push_back({.row = {.id = take.number,
                              .name = take.name,
                              .first_item = first_item_,
                              .last_item = next_item - 1,
                              .timecode = take.timecode},
                      .time_ns = mark.time_ns,
                      .text = std::move(sentence)});
}

void Takes::begin(const pipeline::TakeMark& mark, std::uint64_t next_item) {
  running_ = {.number = ++last_number_,
              .name = mark.name,
              .start_ns = mark.time_ns,
              .timecode = mark.timecode};
  first_item_ = next_item;
  lost_before_ = state_.lost_chunks;
  changes_.push_back({.row = {.id = last_number_,
                              .name = mark.name,
                              .first_item = next_item,
                              .last_item = log::kToTheEnd,
                              .timecode = mark.timecode},
                      .time_ns = mark.time_ns,
                      .text = with_remark(pipeline::words_of(*running_) + " begins", mark.remark)});
}

std::optional<pipeline::Take> Takes::running() const {
  const std::scoped_lock lock(mutex_);
  if (!running_) return std::nullopt;
  return as_of_now();
}

void Takes::set_state(RecorderState state) {
  const std::scoped_lock lock(mutex_);
  state_ = std::move(state);
}

RecorderState Takes::state() const {
  const std::scoped_lock lock(mutex_);
  return state_;
}

std::vector<TakeChange> Takes::next_changes() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(changes_, {});
}

RecordRings::RecordRings(const RingSizes& sizes)
    : chunks_(std::reduce(sizes.chunk_bytes.begin(), sizes.chunk_bytes.end())),
      frames_(sum_of(sizes.slots, &SlotSizes::frame_bytes)),
      decisions_(sum_of(sizes.slots, &SlotSizes::decisions)),
      wants_published_(sum_of(sizes.slots, &SlotSizes::frame_bytes) != 0) {
  for (const std::size_t bytes : sizes.chunk_bytes) sources_.emplace_back(bytes);
  for (const SlotSizes& of_slot : sizes.slots) {
    Slot& slot = slots_.emplace_back(of_slot);
    const auto first = static_cast<std::uint32_t>(slots_.size() - 1);
    slot.newest = &slot.streams.emplace_back(first, nullptr);
  }
}

void RecordRings::add_stream(RecordedStream stream) {
  const std::lock_guard lock(added_mutex_);
  const std::uint32_t place = pipeline::slot_of(stream.id);
  if (place >= slots_.size()) return;
  if (find(stream.id) == nullptr) {
    Slot& slot = slots_[place];
    StreamLosses& losses = slot.streams.emplace_back(stream.id, slot.newest.load(kRelaxed));
    slot.newest.store(&losses, std::memory_order_release);
  }
  streams_.push_back(std::move(stream));
}

RT_SAFE void RecordRings::chunk(std::uint32_t number, std::uint8_t socket,
                                pipeline::Direction direction, std::int64_t arrival_ns,
                                const pipeline::Position& next,
                                std::span<const std::byte> bytes) noexcept {
  newest_item_.store(next.item, kRelaxed);
  Source& source = sources_[number];
  const auto positions = std::as_bytes(next.streams);
  const ChunkHeader header{.bytes = static_cast<std::uint32_t>(positions.size() + bytes.size()),
                           .source = number,
                           .socket = socket,
                           .direction = direction,
                           .positions = static_cast<std::uint16_t>(next.streams.size()),
                           .arrival_ns = arrival_ns,
                           .item = next.item,
                           .lost_before = source.lost.pending()};
  put(source.share, source.lost, chunks_.size_of(header), header.lost_before,
      [&] { return chunks_.push(header, positions, bytes); });
}

RT_SAFE bool RecordRings::keeps_up(std::uint32_t source, std::uint32_t stream) const noexcept {
  const std::uint32_t slot = pipeline::slot_of(stream);
  if (!sources_[source].share.is_half_free()) return false;
  return !wants_published_ || slot >= slots_.size() || slots_[slot].frames.is_half_free();
}

RT_SAFE void RecordRings::decision(const pipeline::Decision& decision) noexcept {
  StreamLosses* stream = find(decision.stream);
  if (stream == nullptr) return;
  Losses& lost = stream->decisions;
  const DecisionRecord record{.decision = decision,
                              .lost_before = lost.pending(),
                              .lost_from_frame = lost.lost_from_frame.load(kRelaxed)};
  Share& share = slots_[pipeline::slot_of(decision.stream)].decisions;
  if (put(share, lost, 1, record.lost_before, [&] { return decisions_.push(record); })) return;
  const std::uint64_t before = record.lost_before == 0 ? kNoFrame : record.lost_from_frame;
  lost.lost_from_frame.store(std::min(before, first_frame_of(decision)), kRelaxed);
}

RT_SAFE void RecordRings::published(std::uint32_t id, std::uint64_t sequence, bool raw,
                                    std::span<const std::byte> bytes) noexcept {
  StreamLosses* stream = find(id);
  if (stream == nullptr) return;
  const FrameHeader header{.bytes = static_cast<std::uint32_t>(bytes.size()),
                           .stream = id,
                           .raw = raw,
                           .sequence = sequence,
                           .lost_before = stream->frames.pending()};
  put(slots_[pipeline::slot_of(id)].frames, stream->frames, frames_.size_of(header),
      header.lost_before, [&] { return frames_.push(header, bytes); });
}

RT_SAFE void RecordRings::unpublished(std::uint32_t id) noexcept {
  if (!wants_published_) return;
  if (StreamLosses* stream = find(id)) stream->frames.total.fetch_add(1, kRelaxed);
}

void RecordRings::keep_model(std::span<const std::byte> bytes) {
  std::string hash = log::sha256_hex(bytes);
  const std::lock_guard lock(added_mutex_);
  if (kept_.insert(std::move(hash)).second) models_.emplace_back(bytes.begin(), bytes.end());
}

Result<pipeline::Take> RecordRings::mark_take(const pipeline::TakeMark& mark) {
  return takes_.mark(mark, newest_item_.load(kRelaxed));
}

std::vector<std::vector<std::byte>> RecordRings::next_models() {
  const std::lock_guard lock(added_mutex_);
  return std::exchange(models_, {});
}

std::vector<RecordedStream> RecordRings::next_streams() {
  const std::lock_guard lock(added_mutex_);
  return std::exchange(streams_, {});
}

// The stream is nearly always the newest of its slot, or the one before.
RT_SAFE StreamLosses* RecordRings::find(std::uint32_t stream) const noexcept {
  const std::uint32_t slot = pipeline::slot_of(stream);
  if (slot >= slots_.size()) return nullptr;
  StreamLosses* found = slots_[slot].newest.load(std::memory_order_acquire);
  while (found != nullptr && found->id != stream) found = found->older;
  return found;
}

RT_SAFE const StreamLosses* RecordRings::losses_of(std::uint32_t stream) const noexcept {
  return find(stream);
}

}  // namespace posed::record
