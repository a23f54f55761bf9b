#include "drivers/vmc/describer.hpp"

#include <algorithm>
#include <cmath>

namespace posed::drivers::vmc {

RT_SAFE void Describer::frame(const std::bitset<kBoneCount>& bones,
                              const std::array<Vec3f, kBoneCount>& position_m,
                              std::int64_t arrival_ns) noexcept {
  grown_ = grown_ || (bones & ~bones_).any();
  bones_ |= bones;
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (!bones[bone]) continue;
    last_ns_[bone] = arrival_ns;
    // The hips' position is where the body is.
    if (bone != kHips) offset_m_[bone] = position_m[bone];
  }
}

RT_SAFE void Describer::title(std::string_view text) noexcept {
  if (text.size() > title_.size()) return;
  std::ranges::copy(text, title_.begin());
  title_size_ = text.size();
}

RT_SAFE void Describer::forget_bones(std::int64_t now_ns) noexcept {
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (now_ns - last_ns_[bone] >= kGone_ns) bones_.reset(bone);
  }
}

RT_SAFE bool Describer::is_gone(const Values& values, std::int64_t now_ns) const noexcept {
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (bones_[bone] && now_ns - last_ns_[bone] < kGone_ns) return false;
  }
  return values.last_ns() == kNoTime_ns || now_ns - values.last_ns() >= kGone_ns;
}

RT_SAFE bool Describer::has_moved() const noexcept {
  for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
    if (!bones_[bone]) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      if (std::abs(offset_m_[bone][i] - described_.offset_m[bone][i]) > kMoved_m) return true;
    }
  }
  return false;
}

RT_SAFE void Describer::update(Values& values, std::int64_t now_ns, Sink& sink) noexcept {
  forget_bones(now_ns);
  if (values.consume_new()) {
    grown_ = true;
    values_new_ = true;
  }
  steady_ = std::exchange(grown_, false) ? 0 : std::min(steady_ + 1, kSteady);
  const bool there = !is_gone(values, now_ns);
  const bool changed = there != there_ || bones_ != described_.bones || (there && values_new_);
  if (steady_ < kSteady || !(changed || has_moved())) return;
  if (described_ns_ != kNoTime_ns) {
    const std::int64_t since_ns = now_ns - described_ns_;
    if (since_ns > 2 * kMaxInterval_ns || changed) between_moves_ns_ = kBetween_ns;
    if (since_ns < between_moves_ns_) return;
    if (!changed) between_moves_ns_ = std::min(2 * between_moves_ns_, kMaxInterval_ns);
  }
  there_ = there;
  describe(values, now_ns, sink);
}

RT_SAFE void Describer::describe(const Values& values, std::int64_t now_ns, Sink& sink) noexcept {
  described_.title = {title_.data(), title_size_};
  described_.bones = bones_;
  described_.offset_m = offset_m_;
  described_.value_count = 0;
  if (there_) values.describe(now_ns, described_);
  described_ns_ = now_ns;
  values_new_ = false;
  sink.description(write_description(described_, bytes_));
}

}  // namespace posed::drivers::vmc
