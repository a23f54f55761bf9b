#include "models/merge/merge_stage.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "models/merge/hand_track.hpp"
#include "models/merge/merge_plan.hpp"
#include "proto/frame/device_time.hpp"

namespace posed::merge {
namespace {

class MergeStage final : public Stage {
 public:
  explicit MergeStage(MergePlan plan);

  void process(const StageFrame& in, StageOut& out) noexcept override;
  // Number 0 is the left glove, 1 the right one.
  void partner(std::size_t partner, const StageFrame& in, StageOut& out) noexcept override;
  [[nodiscard]] std::int64_t next_due_ns() const noexcept override;
  void tick(std::int64_t now_ns, StageOut& out) noexcept override;
  void flush(StageOut& out) noexcept override;

 private:
  [[nodiscard]] bool ready(const Frame& frame, std::int64_t now_ns) const noexcept;
  void release_ready(std::int64_t now_ns, StageOut& out) noexcept;
  void release(std::int64_t now_ns, StageOut& out) noexcept;

  MergePlan plan_;
  std::array<std::optional<HandTrack>, 2> tracks_{};
  std::array<Frame, kMaxWaiting> waiting_{};  // a ring; the oldest is at `first_`
  std::size_t first_ = 0, count_ = 0;
  Frame merged_;  // the last one: the next one's angles stay near to it
};

// When the frame was measured, on the host's clock: by the device's clock, if it has one. A frame
// cannot have been measured after it arrived.
RT_SAFE std::int64_t time_of(const Header& header) noexcept {
  if (!header.clock.valid || header.device_ns == kNoTime_ns) return header.arrival_ns;
  return std::min(to_host_ns(header.clock, header.device_ns), header.arrival_ns);
}

MergeStage::MergeStage(MergePlan plan) : plan_(std::move(plan)) {
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const auto& hand = plan_.hands[i];
    if (hand) tracks_[i].emplace(hand->rate_hz, plan_.hold_ns, hand->map.relaxed());
  }
}

RT_SAFE void MergeStage::process(const StageFrame& in, StageOut& out) noexcept {
  const std::int64_t now_ns = in.frame.header.arrival_ns;
  if (in.frame.skeleton != plan_.body->id) return out.frame(in);  // not this stage's body
  for (auto& track : tracks_) {
    if (track) track->begin(now_ns);
  }
  if (count_ == kMaxWaiting) release(now_ns, out);
  assert(count_ < kMaxWaiting);
  waiting_[(first_ + count_) % kMaxWaiting] = in.frame;
  ++count_;
  release_ready(now_ns, out);
}

// A glove's stage may have delayed the frame, so it came later than its header says.
RT_SAFE void MergeStage::partner(std::size_t partner, const StageFrame& in,
                                 StageOut& out) noexcept {
  if (partner >= tracks_.size() || !tracks_[partner]) return;
  const Frame& frame = in.frame;
  const MergePlan::Hand& hand = *plan_.hands[partner];
  const bool fits = frame.skeleton == hand.glove->id &&
                    frame.joint_count == hand.glove->joints.size() && std::isfinite(frame.lag_ms);
  if (!fits || frame.quality == Quality::kStale) return;
  const double lag_s = std::clamp(static_cast<double>(frame.lag_ms) * 1e-3, 0.0, 1.0);
  const std::int64_t now_ns = frame.header.arrival_ns + nanoseconds(lag_s);
  tracks_[partner]->receive(
      {.time_ns = time_of(frame.header), .quality = frame.quality, .pose = hand.map.read(frame)},
      now_ns);
  release_ready(now_ns, out);
}

RT_SAFE std::int64_t MergeStage::next_due_ns() const noexcept {
  return count_ == 0 ? kNoTime_ns : waiting_[first_].header.arrival_ns + plan_.wait_ns;
}

RT_SAFE void MergeStage::tick(std::int64_t now_ns, StageOut& out) noexcept {
  release_ready(now_ns, out);
}

RT_SAFE void MergeStage::flush(StageOut& out) noexcept {
  while (count_ > 0) release(waiting_[first_].header.arrival_ns, out);
}

RT_SAFE bool MergeStage::ready(const Frame& frame, std::int64_t now_ns) const noexcept {
  if (now_ns >= frame.header.arrival_ns + plan_.wait_ns) return true;
  const std::int64_t time_ns = time_of(frame.header);
  return std::ranges::none_of(
      tracks_, [&](const auto& track) { return track && track->awaited(time_ns, now_ns); });
}

RT_SAFE void MergeStage::release_ready(std::int64_t now_ns, StageOut& out) noexcept {
  while (count_ > 0 && ready(waiting_[first_], now_ns)) release(now_ns, out);
}

// The oldest frame goes out with what is known of the hands at its time.
RT_SAFE void MergeStage::release(std::int64_t now_ns, StageOut& out) noexcept {
  assert(count_ > 0);
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
  first_ = (first_ + 1) % kMaxWaiting;
  --count_;
  merged_.lag_frames = static_cast<std::uint16_t>(merged_.lag_frames + count_);
  plan_.remove_unknown_angles(merged_);
  out.frame({.frame = merged_, .input = &merged_});
}

std::optional<ParameterFault> check(const Parameters& parameters, bool /*has_model*/) {
  if (!wrist_from_name(parameter<std::string>(parameters, "wrist"))) {
    return ParameterFault{"wrist", R"(wrist takes "auto", "body" or "glove")"};
  }
  return std::nullopt;
}

Result<std::shared_ptr<const Skeleton>> leaves(const StageContext& context) {
  auto plan = TRY(MergePlan::make(context));
  return plan.merged.skeleton;
}

Result<std::unique_ptr<Stage>> make(const StageContext& context, const StageModel* /*model*/) {
  auto plan = TRY(MergePlan::make(context));
  return std::make_unique<MergeStage>(std::move(plan));
}

}  // namespace

const StageType& merge_type() {
  static const StageType type{.name = "merge",
                              .summary = "puts the hands of gloves on the body",
                              .parameters = MergeOptions::table().specs(),
                              .partners = {"left", "right"},
                              .input = StageInput::kRenews,
                              .check = check,
                              .leaves = leaves,
                              .make = make};
  return type;
}

}  // namespace posed::merge
