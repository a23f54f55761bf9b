#include "models/merge/merge_plan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <utility>

namespace posed::merge {
namespace {

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

}  // namespace

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

}  // namespace posed::merge
