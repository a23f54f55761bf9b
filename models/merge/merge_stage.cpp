#include "models/merge/merge_stage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "proto/frame/device_time.hpp"

namespace posed::merge {

// A frame cannot have been measured after it arrived. RT-safe.
std::int64_t time_of(const Header& header) noexcept {
  if (!header.clock.valid || header.device_ns == kNoTime_ns) return header.arrival_ns;
  return std::min(to_host_ns(header.clock, header.device_ns), header.arrival_ns);
}

MergeStage::MergeStage(MergePlan plan) : plan_(std::move(plan)) {
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const auto& hand = plan_.hands[i];
    if (hand) tracks_[i].emplace(hand->rate_hz, plan_.hold_ns, hand->map.relaxed());
  }
}

// RT-safe.
void MergeStage::process(const StageFrame& in, StageOut& out) noexcept {
  const std::int64_t now_ns = in.frame.header.arrival_ns;
  if (in.frame.skeleton != plan_.body->id) return out.frame(in);  // not this stage's body
  for (auto& track : tracks_) {
    if (track) track->begin(now_ns);
  }
  if (count_ == kWaiting) release(now_ns, out);
  waiting_[(first_ + count_) % kWaiting] = in.frame;
  ++count_;
  release_ready(now_ns, out);
}

// A glove's stage may have delayed the frame, so it came later than its header says. RT-safe.
void MergeStage::partner(std::size_t partner, const StageFrame& in, StageOut& out) noexcept {
  if (partner >= tracks_.size() || !tracks_[partner]) return;
  const Frame& frame = in.frame;
  const MergePlan::Hand& hand = *plan_.hands[partner];
  const bool fits = frame.skeleton == hand.glove->id &&
                    frame.joint_count == hand.glove->joints.size() && std::isfinite(frame.lag_ms);
  if (!fits || frame.quality == Quality::kStale) return;
  const double lag_s = std::clamp(static_cast<double>(frame.lag_ms) * 1e-3, 0.0, 1.0);
  const std::int64_t now_ns = frame.header.arrival_ns + nanoseconds(lag_s);
  tracks_[partner]->hear(
      {.time_ns = time_of(frame.header), .quality = frame.quality, .pose = hand.map.read(frame)},
      now_ns);
  release_ready(now_ns, out);
}

// RT-safe.
std::int64_t MergeStage::next_due_ns() const noexcept {
  return count_ == 0 ? kNoTime_ns : waiting_[first_].header.arrival_ns + plan_.wait_ns;
}

// RT-safe.
void MergeStage::tick(std::int64_t now_ns, StageOut& out) noexcept { release_ready(now_ns, out); }

// RT-safe.
void MergeStage::flush(StageOut& out) noexcept {
  while (count_ > 0) release(waiting_[first_].header.arrival_ns, out);
}

// RT-safe.
bool MergeStage::ready(const Frame& frame, std::int64_t now_ns) const noexcept {
  if (now_ns >= frame.header.arrival_ns + plan_.wait_ns) return true;
  const std::int64_t time_ns = time_of(frame.header);
  return std::ranges::none_of(
      tracks_, [&](const auto& track) { return track && track->awaited(time_ns, now_ns); });
}

// RT-safe.
void MergeStage::release_ready(std::int64_t now_ns, StageOut& out) noexcept {
  while (count_ > 0 && ready(waiting_[first_], now_ns)) release(now_ns, out);
}

// The oldest frame goes out with what is known of the hands at its time. RT-safe.
void MergeStage::release(std::int64_t now_ns, StageOut& out) noexcept {
  const Frame& body = waiting_[first_];
  plan_.expand(body, merged_);
  const std::int64_t time_ns = time_of(body.header);
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    if (!tracks_[i]) continue;
    const auto hand = tracks_[i]->pose_at(time_ns);
    if (!hand) continue;
    plan_.hands[i]->map.write(hand->pose, merged_);
    merged_.quality = std::max(merged_.quality, hand->quality);
  }
  const std::int64_t waited_ns = std::max<std::int64_t>(now_ns - body.header.arrival_ns, 0);
  merged_.lag_ms += static_cast<float>(static_cast<double>(waited_ns) * 1e-6);
  first_ = (first_ + 1) % kWaiting;
  --count_;
  merged_.lag_frames = static_cast<std::uint16_t>(merged_.lag_frames + count_);
  plan_.remove_unknown_angles(merged_);
  out.frame({.frame = merged_, .input = &merged_});
}

}  // namespace posed::merge
