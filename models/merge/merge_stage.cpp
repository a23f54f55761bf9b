#include "models/merge/merge_stage.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "models/merge/hand_map.hpp"
#include "models/merge/merged_skeleton.hpp"
#include "models/parameter_table.hpp"
#include "proto/frame/device_time.hpp"
#include "proto/frame/smooth_step.hpp"

namespace posed::merge {
namespace {

// The parameters of the merge stage.
struct MergeOptions {
  std::array<std::string, 2> gloves{};  // names of their streams: left, right; empty: none
  double wait_s = 0.015;
  std::string wrist = "auto";
  double hold_s = 1.0;

  [[nodiscard]] static const ParameterTable<MergeOptions, Stage>& table();
};

// Everything about a merged stream that is fixed before its first frame. Built cold from the
// stage's context; then const.
struct MergePlan {
  struct Hand {
    std::shared_ptr<const Skeleton> glove;
    double rate_hz = 0.0;  // of the glove; 0: unknown
    HandMap map;
  };

  // Where the angles of a joint of the hands are in Frame::angle_rad.
  struct JointAngles {
    std::size_t joint = 0, first = 0, count = 0;
  };

  std::shared_ptr<const Skeleton> body;
  MergedSkeleton merged;
  std::uint16_t angles = 0;                    // rotation channels of the merged skeleton
  std::array<std::optional<Hand>, 2> hands{};  // left, right
  std::vector<JointAngles> hand_angles{};
  std::int64_t wait_ns = 0;
  std::int64_t hold_ns = 0;

  // The error names the stream of a glove that does not fit.
  static Result<MergePlan> make(const StageContext& context);
  // The body's frame on the merged skeleton. Joints that the body does not have are not valid, and
  // have the angles that `out` had: the next ones are chosen near to them.
  RT_SAFE void expand(const Frame& in, Frame& out) const noexcept;
  // Call when the hands are written: joints that are not valid have no angles.
  RT_SAFE void remove_unknown_angles(Frame& frame) const noexcept;
};

// Of the joints of this side's hand that a glove may turn.
void add_hand_angles(const Skeleton& skeleton, Side side,
                     std::vector<MergePlan::JointAngles>& angles) {
  std::vector<int> joints{skeleton.joint_of(hand_bone_of(side))};
  for (int finger = 0; finger < kHandJoints; ++finger) {
    joints.push_back(skeleton.joint_of(hand_bone(side, finger)));
  }
  MergePlan::JointAngles one;
  for (std::size_t j = 0; j < skeleton.joints.size(); ++j) {
    const auto of_joint = [j](const Channel& channel) {
      return is_rotation(channel) && channel.joint == j;
    };
    one = {.joint = j,
           .first = one.first + one.count,
           .count = static_cast<std::size_t>(std::ranges::count_if(skeleton.channels, of_joint))};
    if (std::ranges::count(joints, static_cast<int>(j)) > 0) angles.push_back(one);
  }
}

// The value of the parameter `wrist`; empty for an unknown word.
std::optional<Wrist> wrist_from_name(std::string_view name) {
  if (name == "auto") return Wrist::kAuto;
  if (name == "body") return Wrist::kBody;
  if (name == "glove") return Wrist::kGlove;
  return std::nullopt;
}

const ParameterTable<MergeOptions, Stage>& MergeOptions::table() {
  using Table = ParameterTable<MergeOptions, Stage>;
  static const Table table({
      Table::row<[](auto& options) -> auto& { return options.gloves[0]; }>(
          {.name = "left", .help = "stream of the left glove"}),
      Table::row<[](auto& options) -> auto& { return options.gloves[1]; }>(
          {.name = "right", .help = "stream of the right glove"}),
      Table::row<&MergeOptions::wait_s>({.name = "wait_s",
                                         .help = "how long a frame waits for the gloves at most",
                                         .min = 0.0,
                                         .max = 0.1,
                                         .display_name = "wait_ms",
                                         .display_scale = 1000.0}),
      Table::row<&MergeOptions::wrist>(
          {.name = "wrist",
           .help = "who turns the wrist: body, glove, or auto: the glove if it measures it"}),
      Table::row<&MergeOptions::hold_s>(
          {.name = "hold_s",
           .help = "how long the hand of a silent glove stays, before it relaxes",
           .min = 0.0,
           .max = 60.0}),
  });
  return table;
}

Result<MergePlan> MergePlan::make(const StageContext& context) {
  const MergeOptions options = MergeOptions::table().options(context.parameters);
  MergePlan plan;
  plan.body = context.skeleton;
  plan.wait_ns = nanoseconds(options.wait_s);
  plan.hold_ns = nanoseconds(options.hold_s);
  const auto wrist = wrist_from_name(options.wrist);
  std::array<const Skeleton*, 2> gloves{};
  for (std::size_t i = 0; i < gloves.size() && i < context.partners.size(); ++i) {
    gloves[i] = context.partners[i].skeleton.get();
    if (gloves[i] == nullptr) continue;
    TRY(HandMap::check(options.gloves[i], static_cast<Side>(i), *gloves[i]));
  }
  if (std::ranges::all_of(options.gloves, &std::string::empty)) {
    return misuse(
        "stage merge names no glove; name a glove's stream as its left, as its right or"
        " both");
  }
  auto merged = TRY(merge_skeletons(*context.skeleton, gloves));
  plan.merged = std::move(merged);
  const Skeleton& skeleton = *plan.merged.skeleton;
  plan.angles = static_cast<std::uint16_t>(std::ranges::count_if(skeleton.channels, is_rotation));
  for (std::size_t i = 0; i < gloves.size(); ++i) {
    if (gloves[i] == nullptr) continue;
    auto map = TRY(HandMap::bind(options.gloves[i], static_cast<Side>(i), *gloves[i], skeleton,
                                 wrist.value_or(Wrist::kAuto)));
    plan.hands[i] = Hand{.glove = context.partners[i].skeleton,
                         .rate_hz = context.partners[i].rate_hz,
                         .map = std::move(map)};
    add_hand_angles(skeleton, static_cast<Side>(i), plan.hand_angles);
  }
  return plan;
}

RT_SAFE void MergePlan::expand(const Frame& in, Frame& out) const noexcept {
  copy_all_but_pose(in, out);
  out.skeleton = merged.skeleton->id;
  out.joint_count = static_cast<std::uint16_t>(merged.skeleton->joints.size());
  out.angle_count = in.angle_count == merged.angle_of.size() ? angles : std::uint16_t{0};
  out.root_position_m = in.root_position_m;
  out.valid.reset();
  for (std::size_t j = 0; j < out.joint_count; ++j) out.rotation_xyzw[j] = kIdentity;
  for (std::size_t j = 0; j < merged.joint_of.size(); ++j) {
    const std::size_t to = merged.joint_of[j];
    out.rotation_xyzw[to] = in.rotation_xyzw[j];
    out.valid[to] = in.valid[j];
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(in.angle_count, merged.angle_of.size()); ++i) {
    out.angle_rad[merged.angle_of[i]] = in.angle_rad[i];
  }
  for (const JointAngles& joint : hand_angles) {
    for (float& angle_rad : std::span(out.angle_rad).subspan(joint.first, joint.count)) {
      if (!std::isfinite(angle_rad)) angle_rad = 0.0F;
    }
  }
}

RT_SAFE void MergePlan::remove_unknown_angles(Frame& frame) const noexcept {
  for (const JointAngles& joint : hand_angles) {
    if (frame.valid[joint.joint]) continue;
    std::ranges::fill(std::span(frame.angle_rad).subspan(joint.first, joint.count),
                      std::numeric_limits<float>::quiet_NaN());
  }
}

// The newest poses of one glove by their times: 128 of them, a tenth of a second at
// 1000 Hz. One thread; nothing allocates after construction.
class HandHistory {
 public:
  static constexpr std::size_t kPoses = 128;

  [[nodiscard]] bool empty() const noexcept { return count_ == 0; }
  // Call only if there is one.
  RT_SAFE [[nodiscard]] const TimedPose& newest() const noexcept {
    assert(!empty());
    return back(0);
  }

  void clear() noexcept { count_ = 0; }
  // `pose` is later than the newest; the oldest makes room for it.
  RT_SAFE void add(const TimedPose& pose) noexcept {
    assert(empty() || pose.time_ns > newest().time_ns);
    next_ = (next_ + 1) % kPoses;
    poses_[next_] = pose;
    if (count_ < kPoses) ++count_;
  }

  // The pose at this time, interpolated between the two around it; beyond the ends the first or the
  // last one as it is. A joint that only one of the two knows is the one of the nearer. The quality
  // is the worse one. Call only if there is one.
  RT_SAFE [[nodiscard]] TimedPose pose_at(std::int64_t time_ns) const noexcept {
    assert(!empty());
    if (time_ns >= newest().time_ns) return newest();
    std::size_t i = 1;
    while (i < count_ && back(i).time_ns > time_ns) ++i;
    if (i == count_) return back(count_ - 1);
    const TimedPose& before = back(i);
    const TimedPose& after = back(i - 1);
    const double part = static_cast<double>(time_ns - before.time_ns) /
                        static_cast<double>(after.time_ns - before.time_ns);
    const HandPose& nearer = part < 0.5 ? before.pose : after.pose;
    return {.time_ns = time_ns,
            .quality = part > 0.0 ? std::max(before.quality, after.quality) : before.quality,
            .pose = blend(nearer, before.pose, after.pose, part)};
  }

 private:
  [[nodiscard]] const TimedPose& back(std::size_t i) const noexcept {
    return poses_[(next_ + kPoses - i) % kPoses];
  }

  std::array<TimedPose, kPoses> poses_{};
  std::size_t next_ = 0;  // where the newest is
  std::size_t count_ = 0;
};

// What one glove has measured so far, and the hand pose that a body gets at any time. While the
// glove measures, that is its pose at this time; when it falls silent, the last pose is held and
// then eases to a relaxed hand; when it comes back, the hand eases back (models/merge/README.md).
// It knows only the times that are passed to it. One thread; nothing allocates after construction.
class HandTrack {
 public:
  static constexpr std::int64_t kRelax_ns = 500'000'000;   // from the held pose to the relaxed one
  static constexpr std::int64_t kReturn_ns = 100'000'000;  // from there to what the glove measures

  // `rate_hz` of the glove, 0 when unknown; later it is measured. `relaxed`: a hand at rest.
  HandTrack(double rate_hz, std::int64_t hold_ns, const HandPose& relaxed);

  // The body has begun at `now_ns`; from now on the glove is expected.
  RT_SAFE void begin(std::int64_t now_ns) noexcept {
    if (received_ns_ == kNoTime_ns) received_ns_ = now_ns;
  }
  // The glove's next pose, which came at `now_ns`. A pose that is not later than the newest one is
  // ignored, unless the glove's time has jumped back.
  RT_SAFE void receive(const TimedPose& pose, std::int64_t now_ns) noexcept;

  // Whether a body's frame of this time is better with the glove's next pose, and the glove has not
  // been silent for so long that none is likely to come.
  RT_SAFE [[nodiscard]] bool awaited(std::int64_t time_ns, std::int64_t now_ns) const noexcept {
    const bool here = !history_.empty() && history_.newest().time_ns >= time_ns;
    return !here && received_ns_ != kNoTime_ns && now_ns - received_ns_ < silent_after_ns();
  }
  // The pose for a body's frame; empty as long as the glove has not measured any. Times do not
  // decrease.
  RT_SAFE [[nodiscard]] std::optional<TimedPose> pose_at(std::int64_t time_ns) noexcept;

  // Without a frame for so long the glove counts as silent.
  RT_SAFE [[nodiscard]] std::int64_t silent_after_ns() const noexcept;

 private:
  [[nodiscard]] TimedPose source_pose(std::int64_t time_ns) noexcept;

  HandHistory history_;
  HandPose relaxed_;
  std::int64_t hold_ns_;
  std::int64_t interval_ns_;               // between two of the glove's frames, smoothed
  std::int64_t received_ns_ = kNoTime_ns;  // when the last of them came
  std::int64_t used_ns_ = kNoTime_ns;      // time of the measurement that the last frame got
  // What the last frame got, and what the hand eases back from.
  bool has_shown_ = false, returns_ = false;
  std::int64_t shown_ns_ = 0, left_ns_ = 0;
  HandPose shown_, left_;
};

constexpr std::int64_t kUsualInterval_ns = 10'000'000;
constexpr std::int64_t kMaxInterval_ns = 100'000'000;
constexpr std::int64_t kSilentIntervals = 4;
// Less than this is the jitter of a radio link, whatever the rate.
constexpr std::int64_t kMinSilence_ns = 20'000'000;
constexpr std::int64_t kIntervalsAveraged = 16;
// A glove whose time goes back by more than this has started again.
constexpr std::int64_t kJumpBack_ns = kNanosPerSecond;

// From 0 to 1 without a jump of the speed.
RT_SAFE double eased(std::int64_t since_ns, std::int64_t length_ns) noexcept {
  return smooth_step(static_cast<double>(since_ns) / static_cast<double>(length_ns));
}

HandTrack::HandTrack(double rate_hz, std::int64_t hold_ns, const HandPose& relaxed)
    : relaxed_(relaxed),
      hold_ns_(hold_ns),
      interval_ns_(rate_hz > 0.0 ? std::min(nanoseconds(1.0 / rate_hz), kMaxInterval_ns)
                                 : kUsualInterval_ns) {}

RT_SAFE std::int64_t HandTrack::silent_after_ns() const noexcept {
  return std::max(kSilentIntervals * interval_ns_, kMinSilence_ns);
}

RT_SAFE void HandTrack::receive(const TimedPose& pose, std::int64_t now_ns) noexcept {
  received_ns_ = std::max(received_ns_, now_ns);
  if (!history_.empty()) {
    const std::int64_t step_ns = pose.time_ns - history_.newest().time_ns;
    if (step_ns <= 0 && step_ns > -kJumpBack_ns) return;
    if (step_ns < 0 || step_ns > silent_after_ns()) {
      returns_ = has_shown_;
      left_ns_ = shown_ns_;
      left_ = shown_;
    }
    if (step_ns < 0) history_.clear();
    const std::int64_t interval_ns = std::clamp<std::int64_t>(step_ns, 0, kMaxInterval_ns);
    if (step_ns > 0) interval_ns_ += (interval_ns - interval_ns_) / kIntervalsAveraged;
  }
  history_.add(pose);
}

// What the glove says of this time, or is assumed to say.
RT_SAFE TimedPose HandTrack::source_pose(std::int64_t time_ns) noexcept {
  TimedPose at = history_.pose_at(time_ns);
  const std::int64_t before_ns = std::exchange(used_ns_, at.time_ns);
  if (at.time_ns >= time_ns) return at;
  const std::int64_t silent_ns = time_ns - at.time_ns - hold_ns_;
  if (silent_ns > 0) {
    at.pose = blend(at.pose, at.pose, relaxed_, eased(silent_ns, kRelax_ns));
    at.quality = Quality::kPredicted;
  } else if (before_ns == at.time_ns) {
    at.quality = std::max(at.quality, Quality::kHeld);
  }
  return at;
}

RT_SAFE std::optional<TimedPose> HandTrack::pose_at(std::int64_t time_ns) noexcept {
  if (history_.empty()) return std::nullopt;
  TimedPose at = source_pose(time_ns);
  if (returns_) {
    at.pose = blend(at.pose, left_, at.pose, eased(time_ns - left_ns_, kReturn_ns));
    returns_ = time_ns - left_ns_ < kReturn_ns;
  }
  has_shown_ = true;
  shown_ns_ = time_ns;
  shown_ = at.pose;
  return at;
}

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
