#include "models/gate/gate_stage.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "models/elapsed.hpp"
#include "models/gate/track.hpp"
#include "models/parameter_table.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand_skeleton.hpp"

namespace posed::gate {
namespace {

constexpr double kUnknownRate_hz = 60.0;
constexpr double kMaxStep_s = 0.25;                  // longer silences begin anew anyway
constexpr double kCounted_s = 10.0;                  // over which the shares are told
constexpr double kFastest_rad_s2 = 15000 * kDegree;  // of joints: a flick of a finger
constexpr double kFastest_m_s2 = 60.0;               // of a root: a jump's landing

RT_SAFE Bounds bounds_of(double jump, double acceleration) noexcept {
  return {.jump = static_cast<float>(jump), .acceleration = static_cast<float>(acceleration)};
}

RT_SAFE void drop(std::size_t joint, Frame& frame) noexcept {
  frame.valid[joint] = false;
  frame.rotation_xyzw[joint] = kIdentity;
}

struct GateOptions {
  double jump_rad = 8.0 * kDegree;
  double jump_m = 0.5;
};

class GateStage final : public Stage {
 public:
  using Table = ParameterTable<GateOptions, GateStage>;
  static const Table& table();

  GateStage(std::shared_ptr<const Skeleton> skeleton, double rate_hz, const GateOptions& options);

  // Emits one frame for each frame in, at once. Frames of another skeleton pass through.
  RT_SAFE void process(const StageFrame& in, StageOut& out) noexcept override;
  void set(std::size_t parameter, double value) noexcept override {
    table_.set(*this, options_, parameter, value);
  }
  [[nodiscard]] ParameterState state(std::size_t parameter) const noexcept override {
    return table_.state(*this, options_, parameter);
  }
  [[nodiscard]] double reading(std::size_t reading) const noexcept override;

 private:
  RT_SAFE bool gate_angles(float dt_s, Frame& frame) noexcept;
  RT_SAFE bool gate_turns(float dt_s, Frame& frame) noexcept;
  RT_SAFE bool gate_root(float dt_s, Frame& frame) noexcept;
  RT_SAFE void count(std::size_t joint, bool dropped) noexcept {
    share_[joint] += fade_ * ((dropped ? 1.0F : 0.0F) - share_[joint]);
  }

  const Table& table_ = table();
  std::shared_ptr<const Skeleton> skeleton_;
  GateOptions options_;
  double nominal_s_;
  Elapsed elapsed_;
  std::vector<std::size_t> joint_;  // [rotation channel]
  std::vector<Track<AngleSpace>> angle_;
  std::vector<Track<TurnSpace>> turn_;
  Track<PlaceSpace> root_;
  std::vector<float> share_;  // [joint] of samples dropped lately
  float fade_ = 0.0F;         // what one frame counts in it
};

const GateStage::Table& GateStage::table() {
  static const Table table({
      Table::row<&GateOptions::jump_rad>(
          {.name = "jump_rad",
           .help = "an angle that is off by more than this, and by more than is usual, is dropped",
           .min = 1.0 * kDegree,
           .max = 180.0 * kDegree,
           .live = true,
           .display_name = "jump_deg",
           .display_scale = 1.0 / kDegree}),
      Table::row<&GateOptions::jump_m>(
          {.name = "jump_m",
           .help = "a root that is off by more than this, and by more than is usual, stays for a "
                   "frame",
           .min = 0.01,
           .max = 100.0,
           .live = true}),
  });
  return table;
}

GateStage::GateStage(std::shared_ptr<const Skeleton> skeleton, double rate_hz,
                     const GateOptions& options)
    : skeleton_(std::move(skeleton)),
      options_(options),
      nominal_s_(1.0 / (rate_hz > 0.0 ? rate_hz : kUnknownRate_hz)),
      turn_(skeleton_->joints.size()),
      share_(skeleton_->joints.size()) {
  for (const Channel& channel : skeleton_->channels) {
    if (!channel.translation) joint_.push_back(channel.joint);
  }
  angle_.resize(joint_.size());
}

// An angle that is dropped is missing in its joint; the joint's other angles stay.
RT_SAFE bool GateStage::gate_angles(float dt_s, Frame& frame) noexcept {
  const Bounds bounds = bounds_of(options_.jump_rad, kFastest_rad_s2);
  bool any = false;
  for (std::size_t c = 0; c < joint_.size(); ++c) {
    const std::size_t joint = joint_[c];
    const bool first = c == 0 || joint_[c - 1] != joint;
    float& angle_rad = frame.angle_rad[c];
    if (!std::isfinite(angle_rad)) {
      angle_[c].skip(dt_s);
      continue;
    }
    const bool accepted = angle_[c].accept(angle_rad, dt_s, bounds);
    if (first || !accepted) count(joint, !accepted);
    if (accepted) continue;
    angle_rad = std::numeric_limits<float>::quiet_NaN();
    drop(joint, frame);
    any = true;
  }
  return any;
}

RT_SAFE bool GateStage::gate_turns(float dt_s, Frame& frame) noexcept {
  const Bounds bounds = bounds_of(options_.jump_rad, kFastest_rad_s2);
  bool any = false;
  const std::size_t joints = std::min<std::size_t>(turn_.size(), frame.joint_count);
  for (std::size_t j = 0; j < joints; ++j) {
    const Quatf& q = frame.rotation_xyzw[j];
    if (!frame.valid[j]) {
      turn_[j].skip(dt_s);
      continue;
    }
    const bool accepted = turn_[j].accept(Eigen::Quaternionf(q[3], q[0], q[1], q[2]), dt_s, bounds);
    count(j, !accepted);
    if (accepted) continue;
    drop(j, frame);
    any = true;
  }
  return any;
}

// A root has no sample that could be missing: for a frame it stays where it was.
RT_SAFE bool GateStage::gate_root(float dt_s, Frame& frame) noexcept {
  const Bounds bounds = bounds_of(options_.jump_m, kFastest_m_s2);
  const Eigen::Vector3f at_m(frame.root_position_m.data());
  if (!at_m.allFinite()) {
    root_.skip(dt_s);
    return false;
  }
  if (root_.accept(at_m, dt_s, bounds)) return false;
  for (int i = 0; i < 3; ++i) frame.root_position_m[static_cast<std::size_t>(i)] = root_.last()[i];
  return true;
}

RT_SAFE void GateStage::process(const StageFrame& in, StageOut& out) noexcept {
  if (in.frame.skeleton != skeleton_->id) return out.frame(in);
  const double gap_s = elapsed_.next_s(in.frame.header);
  const double dt_s = gap_s > 0.0 ? std::min(gap_s, kMaxStep_s + nominal_s_) : nominal_s_;
  fade_ = static_cast<float>(std::min(dt_s / kCounted_s, 1.0));
  const auto step_s = static_cast<float>(dt_s);
  Frame frame = in.frame;
  const bool angles = !joint_.empty() && frame.angle_count == joint_.size();
  bool changed = angles ? gate_angles(step_s, frame) : gate_turns(step_s, frame);
  if (gate_root(step_s, frame)) changed = true;
  if (!changed)
    return out.frame({.frame = in.frame, .variance_rad2 = in.variance_rad2, .input = &in.frame});
  out.frame({.frame = frame, .variance_rad2 = in.variance_rad2, .input = &frame});
}

double GateStage::reading(std::size_t reading) const noexcept {
  const auto most = std::ranges::max_element(share_);
  if (reading == 0) return most == share_.end() ? 0.0 : static_cast<double>(*most);
  if (most == share_.end() || *most == 0.0F) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(most - share_.begin());
}

}  // namespace

const StageType& gate_type() {
  static const StageType type{
      .name = "gate",
      .summary = "drops values that contradict the motion around them",
      .words = "drop false values",
      .parameters = GateStage::table().specs(),
      .input = StageInput::kRenews,
      // Where nothing bridges what is dropped, a false value is better than none: receivers that
      // do not look at `valid` would see the finger stretched.
      .is_default = [](const Skeleton& skeleton,
                       bool bridged) { return bridged && hand_side(skeleton).has_value(); },
      .make =
          [](const StageContext& context, const StageModel* /*model*/) {
            return Result<std::unique_ptr<Stage>>(std::make_unique<GateStage>(
                context.skeleton, context.rate_hz, GateStage::table().options(context.parameters)));
          },
      .readings = {{.name = "gate_dropped",
                    .help = "share of the samples of a joint that were dropped lately"},
                   {.name = "gate_joint", .help = "the joint of which most were dropped"}}};
  return type;
}

}  // namespace posed::gate
