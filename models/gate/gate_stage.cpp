#include "models/gate/gate_stage.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "models/elapsed.hpp"
#include "models/parameter_table.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/hand.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/rt_safe.hpp"

namespace posed::gate {
namespace {

constexpr double kUnknownRate_hz = 60.0;
constexpr double kMaxStep_s = 0.25;                  // longer silences begin anew anyway
constexpr double kCounted_s = 10.0;                  // over which the shares are told
constexpr double kFastest_rad_s2 = 15000 * kDegree;  // of joints: a flick of a finger
constexpr double kFastest_m_s2 = 60.0;               // of a root: a jump's landing

// Company (models/gate/README.md, "Company").
constexpr float kUnusualBend = 3.0F;  // times the mean distance from the prediction
constexpr auto kMinBend_rad = static_cast<float>(2.0 * kDegree);
constexpr float kBendShare = 0.25F;  // of the suspect's distance
constexpr int kManyParts = 5;        // that are off: they may be garbage
constexpr int kOneWay = 5;           // times as many up as down, or the reverse, are a motion
constexpr auto kFastestBend_rad_s = static_cast<float>(4000.0 * kDegree);  // a snap has 3,800
// Suspects that turned out to be true (models/gate/README.md, "One value").
constexpr float kJudged_s = 60.0F;  // mean time for which they count
constexpr float kFirstTrue = 1.5F;  // so many were, at least
constexpr float kMoreTrue = 1.0F;   // times as many as were false

// Samples that are shown again (models/gate/README.md, "One value").
constexpr float kManyMoving = 3.0F;  // angles; fewer may well repeat by chance
constexpr float kAlone = 0.2F;       // most that repeat while others change
constexpr float kFewSamples = 8.0F;  // before repeats are told
constexpr float kSamples = 100.0F;   // that the share is the mean of
constexpr int kMaxRepeats = 4;       // of one sample

// Share of a hand's angles dropped lately, above which company must be clearer.
constexpr float kFlaky = 0.002F;

constexpr float kForgets_s = 0.25F;  // what is older says nothing, and nothing is held

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

enum class Verdict : std::uint8_t { kNone, kTrue, kFalse };

// Follows one value of a stream and says which samples contradict its motion
// (models/gate/README.md, "One value"). The value is an angle, a rotation or a position; a Space
// says what steps and distances are. RT-safe; no allocation.
template <typename Space>
class Track {
 public:
  using Value = typename Space::Value;

  // Compares a sample with the motion so far. `dt_s`: since the frame before, above 0.
  RT_SAFE void compare(const Value& value, float dt_s, const Bounds& bounds) noexcept {
    since_s_ += dt_s;
    away_s_ += dt_s;
    off_ = 0.0F;
    suspect_ = repeated_ = false;
    if (!known_ || since_s_ > kForgets_s) return begin(value);
    moved_ = Space::distance(last_, value);
    // Gloves are polled faster than they measure: the same value once more is no sample of its own,
    // and what comes after it is as far as from two steps.
    repeated_ = moved_ == 0.0F && since_s_ < kRepeats * dt_s;
    const float ahead = expect(value, bounds);
    off_ = std::min(moved_, ahead);
    const float reach_s = doubts_ > 0 ? dt_s : std::min(since_s_, 2.0F * dt_s);
    const float swing = std::min(kSwing * last_off_, bounds.jump);
    const float near = std::max(kUnusual * usual_, bounds.jump + swing);
    limit_ = std::max(near, bounds.acceleration * reach_s * reach_s);
    suspect_ = ahead > limit_ && moved_ > near;
  }

  // Goes on from the sample compared last. Returns whether it is believed: if it is no suspect, has
  // `company` (other values moved alike) or persists; with `lenient`, because suspects have been
  // true, at once.
  RT_SAFE bool settle(const Value& value, bool company, bool lenient,
                      const Bounds& bounds) noexcept {
    verdict_ = Verdict::kNone;
    if (since_s_ == 0.0F || repeated_) return true;
    if (away_ && away_s_ > kForgets_s) {
      verdict_ = Verdict::kTrue;
      away_ = false;
    }
    // Samples that agree against the past are a motion: two of one that goes on or that comes back
    // from a step, three of a step, because a fault may last for two.
    const bool agrees = suspect_ && doubts_ > 0 && Space::distance(doubt_, value) < kAgree * moved_;
    if (away_ && agrees && Space::distance(left_, value) < kBack * moved_) {
      begin(value);
      return true;
    }
    if (!suspect_ || company) {
      if (doubts_ > 0) verdict_ = Verdict::kFalse;
      if (given_) verdict_ = Verdict::kTrue;
      usual_ += kLearn * (std::min(off_, kUnusual * usual_ + 0.25F * bounds.jump) - usual_);
      last_off_ = off_;
      was_far_ = off_ > kFar * limit_;
      follow(value);
      return true;
    }
    if (goes_back(value, bounds)) {
      verdict_ = Verdict::kFalse;
      return true;
    }
    const bool goes_on = agrees && moved_ > kGoesOn * Space::distance(last_, doubt_);
    if (goes_on) {
      begin(value);
      verdict_ = Verdict::kTrue;
      return true;
    }
    if (agrees && doubts_ >= 2) {
      step(value);
      return true;
    }
    if (lenient && doubts_ == 0) {
      was_far_ = true;
      follow(value);
      given_ = true;
      return true;
    }
    doubts_ = agrees ? doubts_ + 1 : 1;
    doubt_ = value;
    return false;
  }

  // From the last believed sample to the one compared [per s].
  RT_SAFE [[nodiscard]] float speed() const noexcept { return moved_ / since_s_; }

  // Whether the last suspect was true, by what came after it.
  RT_SAFE [[nodiscard]] Verdict verdict() const noexcept { return verdict_; }

  // There was no sample in a frame `dt_s` after the one before.
  RT_SAFE void skip(float dt_s) noexcept {
    since_s_ += dt_s;
    away_s_ += dt_s;
    doubts_ = 0;
  }
  RT_SAFE void forget() noexcept { *this = {}; }
  RT_SAFE [[nodiscard]] const Value& last() const noexcept { return last_; }
  RT_SAFE [[nodiscard]] const Value& expected() const noexcept { return expected_; }
  RT_SAFE [[nodiscard]] bool repeated() const noexcept { return repeated_; }
  RT_SAFE [[nodiscard]] bool suspect() const noexcept { return suspect_; }
  RT_SAFE [[nodiscard]] float off() const noexcept { return off_; }
  RT_SAFE [[nodiscard]] float usual() const noexcept { return usual_; }

 private:
  static constexpr float kUnusual = 5.0F;   // times the mean distance from the prediction
  static constexpr float kSwing = 1.5F;     // of how far the last sample was off
  static constexpr float kFar = 0.5F;       // of the limit
  static constexpr float kFarthest = 3.0F;  // steps that a prediction goes
  static constexpr float kLearn = 0.03F;
  static constexpr float kAgree = 0.75F;
  static constexpr float kGoesOn = 1.2F;
  static constexpr float kRepeats = 2.5F;
  static constexpr float kBack = 0.5F;

  // Where a motion that took `step_s` from there to the last sample leads by now.
  RT_SAFE [[nodiscard]] Value led(const Value& from, float step_s) const noexcept {
    return Space::ahead(from, last_, std::min(since_s_ / step_s, kFarthest));
  }
  // Finds the prediction that is nearest, and returns how far it is where the motion goes on.
  RT_SAFE float expect(const Value& value, const Bounds& bounds) noexcept {
    expected_ = last_;
    if (!(step_s_ > 0.0F)) return moved_;
    Value ahead = led(before_, step_s_);
    float off = Space::distance(ahead, value);
    if (older_s_ > 0.0F) {
      // Noise spoils the speed between two samples; over three it is better known.
      const Value longer = led(older_, step_s_ + older_s_);
      const float longer_off = Space::distance(longer, value);
      const bool noisy = longer_gains_ > 0.0F && kUnusual * usual_ > bounds.jump;
      const float gain = std::clamp(off - longer_off, -bounds.jump, bounds.jump);
      longer_gains_ += kLearn * (gain - longer_gains_);
      if (noisy) {
        ahead = longer;
        off = longer_off;
      }
    }
    if (off < moved_) expected_ = ahead;
    return off;
  }
  // Whether the sample goes on from before the last one, which was far off: that one was false.
  RT_SAFE bool goes_back(const Value& value, const Bounds& bounds) noexcept {
    if (!was_far_ || doubts_ > 0 || !(older_s_ > 0.0F)) return false;
    float off = Space::distance(before_, value);
    if (kUnusual * usual_ <= bounds.jump) {  // else noise spoils the speed
      const float ratio = std::min((step_s_ + since_s_) / older_s_, kFarthest);
      off = std::min(off, Space::distance(Space::ahead(older_, before_, ratio), value));
    }
    if (off > std::max(bounds.jump, bounds.acceleration * since_s_ * since_s_)) return false;
    last_ = before_;
    before_ = older_;
    since_s_ += step_s_;
    step_s_ = older_s_;
    older_s_ = last_off_ = 0.0F;
    was_far_ = false;
    follow(value);
    return true;
  }
  // What persists is believed, but whether it was true shows later: a lost contact comes back.
  RT_SAFE void step(const Value& value) noexcept {
    left_ = last_;
    const float since_s = since_s_;
    begin(value);
    away_ = true;
    away_s_ = since_s;
  }
  RT_SAFE void begin(const Value& value) noexcept {
    last_ = value;
    known_ = true;
    away_ = false;
    doubts_ = 0;
    given_ = false;
    older_s_ = step_s_ = since_s_ = last_off_ = 0.0F;
    was_far_ = false;
  }
  RT_SAFE void follow(const Value& value) noexcept {
    older_ = before_;
    older_s_ = step_s_;
    before_ = last_;
    last_ = value;
    step_s_ = since_s_;
    since_s_ = 0.0F;
    doubts_ = 0;
    given_ = false;
  }

  Value older_{}, before_{}, last_{};  // believed
  Value doubt_{}, expected_{}, left_{};
  float older_s_ = 0.0F;       // from older_ to before_; 0: older_ is not known
  float step_s_ = 0.0F;        // from before_ to last_; 0: before_ is not known
  float since_s_ = 0.0F;       // since last_
  float usual_ = 0.0F;         // mean distance from the prediction
  float longer_gains_ = 0.0F;  // by how much the longer prediction is nearer, in the mean
  float away_s_ = 0.0F;
  float moved_ = 0.0F, off_ = 0.0F;       // of the sample compared last: from last_, from expected_
  float limit_ = 0.0F, last_off_ = 0.0F;  // of its distance; off_ of last_
  bool suspect_ = false, repeated_ = false;
  bool was_far_ = false;  // last_ was, from its prediction
  bool given_ = false;    // last_ is a suspect that was believed
  bool away_ = false;     // the value stepped away from left_, away_s_ ago
  Verdict verdict_ = Verdict::kNone;
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
  RT_SAFE void feel_parts() noexcept;
  RT_SAFE [[nodiscard]] bool has_company(std::size_t c) const noexcept;
  RT_SAFE bool drop_angles(Frame& frame) const noexcept;
  RT_SAFE [[nodiscard]] bool repeats(float dt_s, const Frame& frame) noexcept;
  RT_SAFE void learn_repeats(float moving, float alone) noexcept;
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
  std::vector<float> shown_rad_;       // [rotation channel] in the frame before
  std::vector<std::uint8_t> dropped_;  // [rotation channel] in that frame
  bool any_dropped_ = false;
  float alone_ = 0.0F;                // share of the angles that repeat while others change
  float samples_ = 0.0F;              // of which alone_ is the mean
  bool same_ = false;                 // the frame is like the one before
  float held_s_ = 0.0F;               // how long the last sample has been shown again
  int run_ = 0;                       // in how many frames
  std::vector<float> off_rad_;        // [rotation channel] from the prediction, with its sign
  std::vector<std::size_t> part_;     // [rotation channel] of a hand: two for each finger
  std::vector<float> bend_rad_;       // [part] how far it is off at most; of a hand
  bool scattered_ = false;            // many parts are off, in all directions: no motion
  float true_ = 0.0F, false_ = 0.0F;  // suspects of the hand lately
  float flaky_ = 0.0F;                // share of the hand's angles dropped lately
  float seen_s_ = 0.0F;               // for how long flaky_ has been measured
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
  shown_rad_.resize(joint_.size());
  dropped_.resize(joint_.size());
  off_rad_.resize(joint_.size());
  if (!hand_side(*skeleton_)) return;
  // A finger's first joint, and the two that one tendon, and with some gloves one sensor, bends.
  for (const std::size_t joint : joint_) {
    const std::size_t bone = joint - 1;  // after the wrist
    part_.push_back(2 * (bone / kFingerJoints) + (bone % kFingerJoints > 0 ? 1 : 0));
  }
  bend_rad_.resize(2 * kFingers);
}

// What the parts of a hand do in this frame; a part of which no angle is off stays 0.
RT_SAFE void GateStage::feel_parts() noexcept {
  std::ranges::fill(bend_rad_, 0.0F);
  for (std::size_t c = 0; c < joint_.size(); ++c) {
    const float size = std::abs(off_rad_[c]);
    float& most = bend_rad_[part_[c]];
    if (size <= std::max(kUnusualBend * angle_[c].usual(), kMinBend_rad)) continue;
    if (size > std::abs(most)) most = off_rad_[c];
  }
  int up = 0, down = 0;
  bool contrary = false;  // the parts of a finger
  for (std::size_t p = 0; p < bend_rad_.size(); ++p) {
    up += bend_rad_[p] > 0.0F ? 1 : 0;
    down += bend_rad_[p] < 0.0F ? 1 : 0;
    contrary = contrary || bend_rad_[p] * bend_rad_[p ^ 1U] < 0.0F;
  }
  const bool many = up + down >= kManyParts;
  scattered_ = contrary && many && std::max(up, down) < kOneWay * std::min(up, down);
}

RT_SAFE bool GateStage::has_company(std::size_t c) const noexcept {
  if (bend_rad_.empty() || scattered_) return false;
  const float own = off_rad_[c];
  int with = 0, against = 0;
  for (std::size_t p = 0; p < bend_rad_.size(); ++p) {
    if (p == part_[c] || std::abs(bend_rad_[p]) < kBendShare * std::abs(own)) continue;
    (bend_rad_[p] * own > 0.0F ? with : against) += 1;
  }
  if (flaky_ > kFlaky) return with >= 3 + 2 * against;
  const float beside = bend_rad_[part_[c] ^ 1U];
  const bool finger = beside * own > 0.0F && std::abs(beside) >= kBendShare * std::abs(own);
  return finger || with > against;
}

// Whether the device shows the sample of the frame before once more. One that is polled faster than
// it measures repeats all angles at once; those that stay within their step or dead band repeat
// alone.
RT_SAFE bool GateStage::repeats(float dt_s, const Frame& frame) noexcept {
  const std::span<const float> shown(frame.angle_rad.data(), shown_rad_.size());
  same_ = std::memcmp(shown.data(), shown_rad_.data(), shown.size_bytes()) == 0;
  if (!same_) {
    std::ranges::copy(shown, shown_rad_.begin());
    run_ = 0;
    return false;
  }
  const bool polled = samples_ > kFewSamples && alone_ < kAlone;
  return polled && held_s_ + dt_s <= kForgets_s && ++run_ <= kMaxRepeats;
}

RT_SAFE void GateStage::learn_repeats(float moving, float alone) noexcept {
  if (same_ || moving < kManyMoving) return;
  samples_ = std::min(samples_ + 1.0F, kSamples);
  alone_ += (alone / moving - alone_) / samples_;
}

// An angle that is dropped is missing in its joint; the joint's other angles stay.
RT_SAFE bool GateStage::drop_angles(Frame& frame) const noexcept {
  if (!any_dropped_) return false;
  for (std::size_t c = 0; c < joint_.size(); ++c) {
    if (dropped_[c] == 0) continue;
    frame.angle_rad[c] = std::numeric_limits<float>::quiet_NaN();
    drop(joint_[c], frame);
  }
  return true;
}

RT_SAFE bool GateStage::gate_angles(float dt_s, Frame& frame) noexcept {
  if (repeats(dt_s, frame)) {
    held_s_ += dt_s;
    return drop_angles(frame);
  }
  dt_s += std::exchange(held_s_, 0.0F);
  const Bounds bounds = bounds_of(options_.jump_rad, kFastest_rad_s2);
  for (std::size_t c = 0; c < joint_.size(); ++c) {
    const float angle_rad = frame.angle_rad[c];
    off_rad_[c] = 0.0F;
    if (!std::isfinite(angle_rad)) {
      angle_[c].skip(dt_s);
      continue;
    }
    angle_[c].compare(angle_rad, dt_s, bounds);
    off_rad_[c] = angle_rad < angle_[c].expected() ? -angle_[c].off() : angle_[c].off();
  }
  if (!bend_rad_.empty()) feel_parts();
  const float forget = std::min(dt_s / kJudged_s, 1.0F);
  true_ -= forget * true_;
  false_ -= forget * false_;
  const bool lenient = true_ > kFirstTrue && true_ > kMoreTrue * false_;
  float active = 0.0F;
  float alone = 0.0F;
  float dropped = 0.0F;
  for (std::size_t c = 0; c < joint_.size(); ++c) {
    const std::size_t joint = joint_[c];
    const bool first = c == 0 || joint_[c - 1] != joint;
    float& angle_rad = frame.angle_rad[c];
    dropped_[c] = 0;
    if (!std::isfinite(angle_rad)) continue;
    if (angle_[c].usual() > 0.0F) {
      active += 1.0F;
      alone += angle_[c].repeated() ? 1.0F : 0.0F;
    }
    const bool company =
        angle_[c].suspect() && angle_[c].speed() < kFastestBend_rad_s && has_company(c);
    const bool accepted = angle_[c].settle(angle_rad, company, lenient, bounds);
    if (angle_[c].verdict() == Verdict::kTrue) true_ += 1.0F;
    if (angle_[c].verdict() == Verdict::kFalse) false_ += 1.0F;
    if (first || !accepted) count(joint, !accepted);
    if (accepted) continue;
    dropped_[c] = 1;
    dropped += 1.0F;
  }
  learn_repeats(active, alone);
  if (active > 0.0F) {
    seen_s_ += dt_s;
    flaky_ += std::max(fade_, dt_s / std::max(seen_s_, 1.0F)) * (dropped / active - flaky_);
  }
  any_dropped_ = dropped > 0.0F;
  return drop_angles(frame);
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
    const Eigen::Quaternionf turn(q[3], q[0], q[1], q[2]);
    turn_[j].compare(turn, dt_s, bounds);
    const bool accepted = turn_[j].settle(turn, false, false, bounds);
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
  root_.compare(at_m, dt_s, bounds);
  if (root_.settle(at_m, false, false, bounds)) return false;
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
