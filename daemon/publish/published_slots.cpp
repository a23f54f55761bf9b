#include "daemon/publish/published_slots.hpp"

#include <algorithm>
#include <utility>

#include "daemon/pipeline/messages.hpp"

namespace posed::publish {
namespace {

template <typename Streams>
auto with_id(Streams& streams, std::uint32_t id) {
  return std::ranges::find_if(streams,
                              [&](const auto& stream) { return stream->info.stream == id; });
}

}  // namespace

void PublishedSlots::add(std::unique_ptr<PublishedStream> stream) {
  const std::scoped_lock lock(mutex_);
  additions_.push_back(std::move(stream));
}

void PublishedSlots::set_stages(std::uint32_t stream, std::vector<StageInfo> stages) {
  const std::scoped_lock lock(mutex_);
  if (PublishedStream* const found = find(stream)) return found->set_stages(std::move(stages));
  const auto coming = with_id(additions_, stream);
  if (coming != additions_.end()) (*coming)->set_stages(std::move(stages));
}

PublishedStream* PublishedSlots::current(std::uint32_t stream) noexcept {
  PublishedStream* const found = holder(pipeline::slot_of(stream));
  return found != nullptr && found->info.stream == stream ? found : nullptr;
}

PublishedStream* PublishedSlots::holder(std::uint32_t slot) noexcept {
  if (slot >= slots_.size() || slots_[slot].empty()) return nullptr;
  return slots_[slot].front().get();
}

PublishedStream* PublishedSlots::find(std::uint32_t stream) noexcept {
  const std::uint32_t slot = pipeline::slot_of(stream);
  if (slot >= slots_.size()) return nullptr;
  const auto found = with_id(slots_[slot], stream);
  return found == slots_[slot].end() ? nullptr : found->get();
}

void PublishedSlots::place_additions() {
  const std::scoped_lock lock(mutex_);
  for (auto& stream : additions_) {
    const std::uint32_t slot = pipeline::slot_of(stream->info.stream);
    if (slot < slots_.size()) slots_[slot].push_back(std::move(stream));
  }
  additions_.clear();
  changed_ = true;
}

void PublishedSlots::advance(std::uint32_t slot) {
  const std::scoped_lock lock(mutex_);
  count_left(*slots_[slot].front());
  slots_[slot].erase(slots_[slot].begin());
  changed_ = true;
}

void PublishedSlots::count_left(const PublishedStream& stream) {
  const PublishedStream::Counts counts = stream.counts();
  left_.frames += counts.frames;
  left_.samples += counts.samples;
}

void PublishedSlots::fill(v1::Stats& stats) const {
  const std::scoped_lock lock(mutex_);
  for (const Slot& slot : slots_) {
    if (!slot.empty()) *stats.add_stream() = slot.front()->stats();
  }
  fill_left(stats);
}

std::vector<StreamFigures> PublishedSlots::figures() const {
  const std::scoped_lock lock(mutex_);
  std::vector<StreamFigures> all;
  for (const Slot& slot : slots_) {
    if (!slot.empty()) all.push_back(slot.front()->figures());
  }
  return all;
}

void PublishedSlots::fill_left(v1::Stats& stats) const {
  stats.set_left_frames(left_.frames);
  stats.set_left_samples(left_.samples);
}

void PublishedSlots::remove(std::uint32_t stream) {
  const std::uint32_t slot = pipeline::slot_of(stream);
  if (slot >= slots_.size()) return;
  const std::scoped_lock lock(mutex_);
  const auto found = with_id(slots_[slot], stream);
  if (found == slots_[slot].end()) return;
  count_left(**found);
  slots_[slot].erase(found);
  changed_ = true;
}

}  // namespace posed::publish
