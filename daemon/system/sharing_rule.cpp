#include "daemon/system/sharing_rule.hpp"

#include <algorithm>

namespace posed::system {

bool SharingRule::share(const Seen& seen, std::int64_t now_ns) noexcept {
  if (since_ns_ == kNoTime_ns) since_ns_ = now_ns;
  const std::int64_t passed_ns = now_ns - since_ns_;
  const bool fits = seen.load <= kFull && seen.held_up <= kHeldUp;
  const bool may_try = seen.load < 1.0 && passed_ns >= try_after_ns_;
  if (shared_ ? fits : !may_try) return shared_;
  if (shared_) {
    const bool lasted = passed_ns >= kFirstTry_ns;
    try_after_ns_ = lasted ? kFirstTry_ns : std::min(2 * try_after_ns_, kRarest_ns);
  }
  since_ns_ = now_ns;
  return shared_ = !shared_;
}

std::int64_t held_up_ns(std::span<const ThreadShare> threads) noexcept {
  std::int64_t sum_ns = 0;
  for (const ThreadShare& thread : threads) {
    std::int64_t lost_ns = thread.time.waited_ns;
    for (const ThreadShare& other : threads) {
      if (other.priority > thread.priority) lost_ns -= other.time.ran_ns;
    }
    sum_ns += std::max<std::int64_t>(lost_ns, 0);
  }
  return sum_ns;
}

}  // namespace posed::system
