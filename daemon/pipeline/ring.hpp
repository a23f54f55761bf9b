// Ring: a bounded queue between one producer and one consumer thread; its size is fixed at the
// start. No call blocks; push() on a full ring fails. The consumer reads elements in place.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <boost/lockfree/spsc_queue.hpp>

#include "proto/frame/rt_safe.hpp"

namespace posed::pipeline {

// The size of a ring in time: it holds half a second of everything that may come, and bursts.
inline constexpr double kRingDepth_s = 0.5;
[[nodiscard]] inline std::size_t ring_slots(double items_per_s) {
  return static_cast<std::size_t>(std::ceil(std::max(items_per_s * kRingDepth_s, 64.0)));
}

// Extra slots for events. They have no share of their own, and one that acknowledges a command must
// never be lost.
inline constexpr std::size_t kEventSlots = 128;

template <typename T>
class Ring {
 public:
  // Touches all of its memory, so that later no access causes a page fault.
  explicit Ring(std::size_t slots) : queue_(slots) {
    const T blank{};
    while (queue_.push(blank)) {
    }
    queue_.reset();
  }

  // Producer. False when full.
  RT_SAFE [[nodiscard]] bool push(const T& item) noexcept { return queue_.push(item); }
  // Producer: whether so many pushes will succeed.
  RT_SAFE [[nodiscard]] bool has_room(std::size_t count = 1) const noexcept {
    return queue_.write_available() >= count;
  }

  // Consumer: hands the oldest element to `use(T&)` in place, then frees its slot. False when
  // empty. RT-safe if `use` is.
  template <typename Use>
  [[nodiscard]] bool consume(Use&& use) noexcept {
    return queue_.consume_one(std::forward<Use>(use)) > 0;
  }
  // Consumer.
  RT_SAFE [[nodiscard]] bool empty() const noexcept { return queue_.read_available() == 0; }

 private:
  boost::lockfree::spsc_queue<T> queue_;
};

}  // namespace posed::pipeline
