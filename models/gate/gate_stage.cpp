#include "models/gate/gate_stage.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "models/elapsed.hpp"
#include "models/parameter_table.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/rt_safe.hpp"

namespace posed::gate {
namespace {

constexpr double kUnknownRate_hz = 60.0;
constexpr double kMaxStep_s = 0.25;                  // longer silences begin anew anyway
constexpr double kCounted_s = 10.0;                  // over which the shares are told
constexpr double kFastest_rad_s2 = 15000 * kDegree;  // of joints: a flick of a finger
constexpr double kFastest_m_s2 = 60.0;               // of a root: a jump's landing

// What a value may do [its unit].
struct Bounds {
  float jump = 0.0F;          // always allowed from one sample to the next
  float acceleration = 0.0F;  // per s^2: what people do
};

struct AngleSpace {  // rad, may wrap
  using Value = float;
  RT_SAFE static float distance(float a, float b) noexcept { return std::abs(wrapped(a - b)); }
  // Where a motion from `a` to `b` is `ratio` of that time later.
  RT_SAFE static float ahead(float a, float b, float ratio) noexcept {
    return b + ratio * wrapped(b - a);
  }

 private:
  RT_SAFE static float wrapped(float angle) noexcept {
    constexpr auto kTurn = static_cast<float>(2.0 * std::numbers::pi);
    return std::abs(angle) < 0.5F * kTurn ? angle : std::remainder(angle, kTurn);
  }
};

struct TurnSpace {  // a rotation; distances in rad, by the chord
  using Value = Eigen::Quaternionf;
  RT_SAFE static float distance(const Value& a, const Value& b) noexcept {
    return 2.0F * (a.conjugate() * b).vec().norm();
  }
  RT_SAFE static Value ahead(const Value& a, const Value& b, float ratio) noexcept {
    Value step = a.conjugate() * b;
    if (step.w() < 0.0F) step.coeffs() = -step.coeffs();
    step.vec() *= ratio;
    step.w() = 1.0F + ratio * (step.w() - 1.0F);
    return (b * step).normalized();
  }
};

struct PlaceSpace {  // m
  using Value = Eigen::Vector3f;
  RT_SAFE static float distance(const Value& a, const Value& b) noexcept { return (a - b).norm(); }
  RT_SAFE static Value ahead(const Value& a, const Value& b, float ratio) noexcept {
    return b + ratio * (b - a);
  }
};

// Follows one value of a stream and says which samples contradict its motion
// (models/gate/README.md, "One value"). The value is an angle, a rotation or a position; a Space
// says what steps and distances are. RT-safe; no allocation.
template <typename Space>
class Track {
 public:
  using Value = typename Space::Value;

  // Whether this sample is believed. `dt_s`: since the frame before, above 0.
  RT_SAFE [[nodiscard]] bool accept(const Value& value, float dt_s, const Bounds& bounds) noexcept {
    since_s_ += dt_s;
    if (!known_ || since_s_ > kForgets_s) return begin(value);
    const float moved = Space::distance(last_, value);
    // Gloves are polled faster than they measure: the same value once more is no sample of its own,
    // and what comes after it is as far as from two steps.
    if (moved == 0.0F && since_s_ < kRepeats * dt_s) return true;
    const float off = std::min(moved, distance_to_prediction(value));
    const float reach_s = std::min(since_s_, 2.0F * dt_s);
    const float limit =
        std::max({kUnusual * usual_, bounds.jump, bounds.acceleration * reach_s * reach_s});
    if (off <= limit) {
      follow(value);
      usual_ += kLearn * (std::min(off, kUnusual * usual_ + 0.25F * bounds.jump) - usual_);
      return true;
    }
    // Samples that agree against the past are a motion: two of one that goes on, three of a step,
    // because a fault may last for two.
    const bool agrees = doubts_ > 0 && Space::distance(doubt_, value) < kAgree * moved;
    const bool goes_on = agrees && moved > kGoesOn * Space::distance(last_, doubt_);
    if (goes_on || (agrees && doubts_ >= 2)) {
      last_ = value;
      step_s_ = since_s_ = 0.0F;
      doubts_ = 0;
      return true;
    }
    doubts_ = agrees ? doubts_ + 1 : 1;
    doubt_ = value;
    return false;
  }

  // There was no sample in a frame `dt_s` after the one before.
  RT_SAFE void skip(float dt_s) noexcept {
    since_s_ += dt_s;
    doubts_ = 0;
  }
  RT_SAFE void forget() noexcept { *this = {}; }
  RT_SAFE [[nodiscard]] const Value& last() const noexcept { return last_; }

 private:
  static constexpr float kForgets_s = 0.25F;  // what is older says nothing, and nothing is held
  static constexpr float kUnusual = 6.0F;     // times the mean distance from the prediction
  static constexpr float kLearn = 0.03F;
  static constexpr float kAgree = 0.75F;
  static constexpr float kGoesOn = 1.2F;
  static constexpr float kRepeats = 2.5F;

  RT_SAFE [[nodiscard]] float distance_to_prediction(const Value& value) const noexcept {
    if (!(step_s_ > 0.0F)) return Space::distance(last_, value);
    const float ratio = std::min(since_s_ / step_s_, 3.0F);
    return Space::distance(Space::ahead(before_, last_, ratio), value);
  }
  RT_SAFE bool begin(const Value& value) noexcept {
    last_ = value;
    known_ = true;
    doubts_ = 0;
    step_s_ = since_s_ = 0.0F;
    return true;
  }
  RT_SAFE void follow(const Value& value) noexcept {
    before_ = last_;
    last_ = value;
    step_s_ = since_s_;
    since_s_ = 0.0F;
    doubts_ = 0;
  }

  Value before_{}, last_{}, doubt_{};
  float step_s_ = 0.0F;   // from before_ to last_; 0: before_ is not known
  float since_s_ = 0.0F;  // since last_
  float usual_ = 0.0F;    // mean distance from the prediction
  bool known_ = false;
  int doubts_ = 0;  // samples dropped in a row that agree; the last was doubt_
};

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
