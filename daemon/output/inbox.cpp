#include "daemon/output/inbox.hpp"

#include <algorithm>
#include <mutex>

namespace posed::output {

bool Delivery::put(Part part, const Frame& frame) noexcept {
  const bool full = count_ == kDepth;
  if (full) {
    first_ = (first_ + 1) % kDepth;
    --count_;
  }
  Entry& entry = frames_[(first_ + count_) % kDepth];
  entry.part = part;
  entry.frame = frame;
  ++count_;
  return full;
}

void Delivery::swap_frames(Delivery& other) noexcept {
  frames_.swap(other.frames_);
  std::swap(first_, other.first_);
  std::swap(count_, other.count_);
}

std::size_t Delivery::remove(Part part) noexcept {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Entry& entry = frames_[(first_ + i) % kDepth];
    if (entry.part == part) continue;
    if (kept != i) frames_[(first_ + kept) % kDepth] = entry;
    ++kept;
  }
  return std::exchange(count_, kept) - kept;
}

bool Inbox::wants(std::string_view stream) const noexcept {
  return !stream.empty() && std::ranges::find(names_, stream) != names_.end();
}

std::optional<Part> Inbox::part_of(std::uint32_t stream) const noexcept {
  for (const Part part : kAllParts) {
    const auto& there = waiting_.streams[index_of(part)];
    if (there != nullptr && there->id == stream) return part;
  }
  return std::nullopt;
}

void Inbox::stream_comes(const publish::StreamInfo& stream) {
  const auto named = std::ranges::find(names_, stream.name);
  if (named == names_.end()) return;
  auto coming =
      std::make_shared<const PartStream>(PartStream{.id = stream.stream,
                                                    .name = stream.name,
                                                    .skeleton = stream.skeleton,
                                                    .samples = stream.description.samples});
  const auto part = static_cast<Part>(named - names_.begin());
  {
    const std::scoped_lock lock(mutex_);
    waiting_.streams[index_of(part)].swap(coming);
    dropped_ += waiting_.remove(part);  // they have another skeleton
    if (part == Part::kBody) waiting_.sample.reset();
  }
  wake_.notify();
}

void Inbox::frame(const Frame& frame) noexcept {
  {
    const std::scoped_lock lock(mutex_);
    const auto part = part_of(frame.header.stream);
    if (!part) return;
    ++frames_;
    if (waiting_.put(*part, frame)) ++dropped_;
  }
  wake_.notify();
}

void Inbox::sample(const Sample& sample) noexcept {
  const std::scoped_lock lock(mutex_);
  // It goes out with the next frame, so nobody is woken.
  if (part_of(sample.header.stream) == Part::kBody) waiting_.sample = sample;
}

void Inbox::stream_leaves(std::uint32_t stream) noexcept {
  std::shared_ptr<const PartStream> leaving;  // freed behind the lock
  {
    const std::scoped_lock lock(mutex_);
    const auto part = part_of(stream);
    if (!part) return;
    waiting_.streams[index_of(*part)].swap(leaving);
    dropped_ += waiting_.remove(*part);
  }
  wake_.notify();
}

void Inbox::receive(Delivery& into) {
  into.count_ = 0;
  into.streams = {};  // freed before the lock
  const std::scoped_lock lock(mutex_);
  waiting_.swap_frames(into);
  into.streams = waiting_.streams;
  into.sample = std::exchange(waiting_.sample, std::nullopt);
}

}  // namespace posed::output
