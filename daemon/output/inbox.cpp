#include "daemon/output/inbox.hpp"

#include <algorithm>
#include <mutex>

namespace posed::output {

bool Delivery::put(std::size_t place, const Frame& frame) noexcept {
  Queue& queue = queues_[place];
  const bool full = queue.count == kDepth;
  if (full) {
    queue.first = (queue.first + 1) % kDepth;
    --queue.count;
  }
  Entry& entry = queue.entries[(queue.first + queue.count) % kDepth];
  entry.number = ++number_;
  entry.frame = frame;
  ++queue.count;
  return full;
}

void Delivery::clear() noexcept {
  for (Queue& queue : queues_) queue.count = 0;
}

void Delivery::swap_frames(Delivery& other) noexcept { queues_.swap(other.queues_); }

std::size_t Delivery::remove(std::size_t place) noexcept {
  return std::exchange(queues_[place].count, 0);
}

std::optional<std::size_t> Delivery::oldest(const std::vector<std::size_t>& used) const noexcept {
  std::optional<std::size_t> oldest;
  std::uint64_t number = 0;
  for (std::size_t place = 0; place < queues_.size(); ++place) {
    if (used[place] == queues_[place].count) continue;
    const std::uint64_t this_number = queues_[place].at(used[place]).number;
    if (oldest && this_number > number) continue;
    oldest = place;
    number = this_number;
  }
  return oldest;
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
  into.clear();
  into.streams.assign(names_.size(), nullptr);  // freed, and allocated, before the lock
  into.samples.assign(names_.size(), std::nullopt);
  const std::scoped_lock lock(mutex_);
  waiting_.swap_frames(into);
  into.streams = waiting_.streams;
  into.samples.swap(waiting_.samples);
}

}  // namespace posed::output
