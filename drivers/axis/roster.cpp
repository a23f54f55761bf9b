#include "drivers/axis/roster.hpp"

#include <algorithm>
#include <cmath>

namespace posed::drivers::axis {
namespace {

constexpr std::int64_t kGone_ns = kNanosPerSecond;
constexpr std::int64_t kDescribeEvery_ns = kNanosPerSecond / 2;
// The lengths of a stream's bones waver by up to 0.5 cm, because the applications shift bones.
// Proportions that are set anew stay.
constexpr float kOtherLength_cm = 1.5F;
constexpr std::int64_t kSettled_ns = kNanosPerSecond;

// The time between two arrivals, which a damaged log may put anywhere.
RT_SAFE std::int64_t since(std::int64_t now_ns, std::int64_t then_ns) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(now_ns) -
                                   static_cast<std::uint64_t>(then_ns));
}

RT_SAFE Proportions offsets_of(const Message& message) noexcept {
  Proportions offset_cm = default_proportions();
  for (std::size_t b = 1; b < kBones; ++b) {
    const double* const at = message.values.data() + rotations_at(message.content, b) - 3;
    offset_cm[b] = offset_from(
        b, {static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])});
  }
  return offset_cm;
}

RT_SAFE bool other_lengths(const Proportions& a, const Proportions& b) noexcept {
  const auto length = [](const Vec3f& v) { return std::hypot(v[0], v[1], v[2]); };
  for (std::size_t i = 1; i < kBones; ++i) {
    if (std::abs(length(a[i]) - length(b[i])) > kOtherLength_cm) return true;
  }
  return false;
}

}  // namespace

RT_SAFE Present* Roster::find(const Avatar& avatar) noexcept {
  Present* free = nullptr;
  for (Present& present : all_) {
    if (present.used && present.entry.avatar == avatar) return &present;
    if (!present.used && free == nullptr) free = &present;
  }
  if (free == nullptr) return nullptr;
  *free = {};
  free->entry.avatar = avatar;
  free->entry.figure = figure_;
  free->first_tick = newest_tick_;
  free->used = changed_ = true;
  return free;
}

RT_SAFE void Roster::see(Present& present, const Message& message, std::int64_t now_ns) noexcept {
  // After a pause of the whole stream, each avatar gets its time to come back.
  if (since(now_ns, received_ns_) > kGone_ns) {
    for (Present& other : all_) other.seen_ns = now_ns;
  }
  received_ns_ = present.seen_ns = now_ns;
  if (message.frame_number != 0) count_frames(present, message.frame_number);
  if (present.entry.reference != message.content.reference) {
    present.entry.reference = message.content.reference;
    changed_ = true;
  }
  if (message.content.displacement) measure(present, message, now_ns);
}

RT_SAFE void Roster::count_frames(Present& present, std::uint32_t frame_number) noexcept {
  present.tick = present.first_tick + present.counter.to(frame_number).ticks;
  newest_tick_ = std::max(newest_tick_, present.tick);
}

RT_SAFE void Roster::measure(Present& present, const Message& message,
                             std::int64_t now_ns) noexcept {
  const Proportions offset_cm = offsets_of(message);
  if (present.entry.measured) {
    if (!other_lengths(offset_cm, present.entry.offset_cm)) {
      present.differs_ns = kNoTime_ns;
      return;
    }
    if (present.differs_ns == kNoTime_ns) present.differs_ns = now_ns;
    if (since(now_ns, present.differs_ns) < kSettled_ns) return;
  }
  present.entry.offset_cm = offset_cm;
  present.entry.measured = true;
  present.differs_ns = kNoTime_ns;
  changed_ = true;
}

RT_SAFE void Roster::forget_gone(std::int64_t now_ns) noexcept {
  for (Present& present : all_) {
    if (!present.used || since(now_ns, present.seen_ns) <= kGone_ns) continue;
    present.used = false;
    changed_ = true;
  }
}

RT_SAFE std::span<const std::byte> Roster::news(std::int64_t now_ns) noexcept {
  forget_gone(now_ns);
  if (!changed_ || (described_ && since(now_ns, described_ns_) < kDescribeEvery_ns)) return {};
  const std::span<std::byte> list(list_);
  std::size_t size = write_list_head(
      order_, static_cast<std::size_t>(std::ranges::count(all_, true, &Present::used)), list);
  for (const Present& present : all_) {
    if (present.used) size += write_entry(present.entry, list.subspan(size));
  }
  changed_ = false;
  described_ = true;
  described_ns_ = now_ns;
  return list.first(size);
}

}  // namespace posed::drivers::axis
