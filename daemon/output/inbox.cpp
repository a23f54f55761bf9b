#include "daemon/output/inbox.hpp"

#include <algorithm>
#include <mutex>

namespace posed::output {

bool Delivery::put(std::size_t place, const Frame& frame) noexcept {
  const bool full = count_ == frames_.size();
  if (full) {
    first_ = (first_ + 1) % frames_.size();
    --count_;
  }
  Entry& entry = frames_[(first_ + count_) % frames_.size()];
  entry.place = place;
  entry.frame = frame;
  ++count_;
  return full;
}

void Delivery::swap_frames(Delivery& other) noexcept {
  frames_.swap(other.frames_);
  std::swap(first_, other.first_);
  std::swap(count_, other.count_);
}

std::size_t Delivery::remove(std::size_t place) noexcept {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    const Entry& entry = frames_[(first_ + i) % frames_.size()];
    if (entry.place == place) continue;
    if (kept != i) frames_[(first_ + kept) % frames_.size()] = entry;
    ++kept;
  }
  return std::exchange(count_, kept) - kept;
}

bool Inbox::wants(std::string_view stream) const noexcept {
  return !stream.empty() && std::ranges::find(names_, stream) != names_.end();
}

std::optional<std::size_t> Inbox::place_of(std::uint32_t stream) const noexcept {
  for (std::size_t place = 0; place < waiting_.streams.size(); ++place) {
    const auto& there = waiting_.streams[place];
    if (there != nullptr && there->id == stream) return place;
  }
  return std::nullopt;
}

void Inbox::stream_comes(const publish::StreamInfo& stream) {
  const auto named = std::ranges::find(names_, stream.name);
  if (named == names_.end()) return;
  auto coming = std::make_shared<const LiveStream>(LiveStream{.id = stream.stream,
                                                              .name = stream.name,
                                                              .skeleton = stream.skeleton,
                                                              .samples = stream.description.samples,
                                                              .rate_hz = stream.rate_hz,
                                                              .number = stream.number});
  const auto place = static_cast<std::size_t>(named - names_.begin());
  {
    const std::scoped_lock lock(mutex_);
    waiting_.streams[place].swap(coming);
    dropped_ += waiting_.remove(place);  // they have another skeleton
    waiting_.samples[place].reset();
  }
  wake_.notify();
}

void Inbox::frame(const Frame& frame) noexcept {
  {
    const std::scoped_lock lock(mutex_);
    const auto place = place_of(frame.header.stream);
    if (!place) return;
    ++frames_;
    if (waiting_.put(*place, frame)) ++dropped_;
  }
  wake_.notify();
}

void Inbox::sample(const Sample& sample) noexcept {
  const std::scoped_lock lock(mutex_);
  // It goes out with the next frame, so nobody is woken.
  if (const auto place = place_of(sample.header.stream)) waiting_.samples[*place] = sample;
}

void Inbox::stream_leaves(std::uint32_t stream) noexcept {
  std::shared_ptr<const LiveStream> leaving;  // freed behind the lock
  {
    const std::scoped_lock lock(mutex_);
    const auto place = place_of(stream);
    if (!place) return;
    waiting_.streams[*place].swap(leaving);
    dropped_ += waiting_.remove(*place);
  }
  wake_.notify();
}

void Inbox::drain(Delivery& into) {
  into.count_ = 0;
  into.streams.assign(names_.size(), nullptr);  // freed, and allocated, before the lock
  into.samples.assign(names_.size(), std::nullopt);
  const std::scoped_lock lock(mutex_);
  waiting_.swap_frames(into);
  into.streams = waiting_.streams;
  into.samples.swap(waiting_.samples);
}

}  // namespace posed::output
