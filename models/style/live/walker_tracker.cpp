#include "models/style/live/walker_tracker.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "proto/frame/rt_safe.hpp"
#include "proto/frame/smooth_step.hpp"

namespace posed::style {
namespace {

constexpr double kLastSecond_s = 1.0;
constexpr double kMinPart_s = 1.0 / 48.0;  // so that all of them fit
constexpr double kMinKnown_s = 0.5;

// models/style/README.md, "Gate", says what these were measured on.
constexpr double kNear_deg = 28.0, kFar_deg = 35.0;         // to the nearest pose, as it is
constexpr double kOwnNear_deg = 19.0, kOwnFar_deg = 23.5;   // from the walker's neutral pose
constexpr double kSame_deg = 7.0, kOther_deg = 9.5;         // either; so near at any pace
constexpr double kStill_deg_s = 8.0, kMoving_deg_s = 16.0;  // PoseSpeed
constexpr double kRest = 0.25, kSwing = 0.4;                // of the training's least swing
constexpr double kTooSlow = 0.2, kSlow = 0.3;               // of the training's fastest cadence
constexpr double kSlowestPace = 0.45;                       // the same, at which strides are seen
constexpr double kFirstStep_rad =
    4.0;  // of a stride after rest, as the cadence lags by half a second
constexpr double kFast = 1.2, kTooFast = 1.32;
constexpr double kOfGait = 0.5;  // what LiveGait's correlation counts, in shares of that cadence,
constexpr double kWalk = 0.2;    // above the training's highest, which counts as at least this
constexpr double kOfWide = 0.5;  // the more where the legs swing wide, in shares of the training's
constexpr double kUsual = 1.6, kWide = 2.1;  // least swing
constexpr double kTaughtRun = 0.4;           // correlation of a training that has runs
constexpr double kOfFlight = 0.25;  // what a fall counts, in shares of that cadence, where it is
constexpr double kGravity_m_s2 = 9.81, kFalls = 1.1, kFlies = 1.2;  // in shares of gravity
constexpr double kOwnFast = 1.15;  // a walker's own cadence above this counts in its place

constexpr double kCadence_s = 0.1;  // time constant of the low-pass on the cadence
constexpr double kSteady_s = 0.4;   // the same without what a step adds
constexpr double kThere = 1e-5;     // nearer is there

// 0 below `low`, 1 above `high`, without a kink between.
double rise(double value, double low, double high) noexcept {
  return smooth_step((value - low) / (high - low));
}

double between(double from, double to, double share) noexcept { return from + share * (to - from); }

constexpr double kInterruption_s = 1.0;  // of the frames

// A part of the body walks up to the first of these distances from every training pose [deg rms
// over its joints], and does something else from the second on: models/style/README.md, "Busy
// limbs".
struct Limits {
  float walks, other;
};
constexpr Limits kUnknownArm{36.0F, 48.0F}, kArm{12.0F, 20.0F};
// In the order of LoosePart.
constexpr std::array<Limits, kLooseParts> kUnknownWalker{
    {{14.0F, 20.0F}, {16.0F, 24.0F}, kUnknownArm, kUnknownArm, kUnknownArm, kUnknownArm}};
constexpr std::array<Limits, kLooseParts> kKnownWalker{
    {{7.0F, 13.0F}, {8.0F, 14.0F}, kArm, kArm, kArm, kArm}};

float share_below(float value, const Limits& limits) noexcept {
  const float part = std::clamp((limits.other - value) / (limits.other - limits.walks), 0.0F, 1.0F);
  return part * part * (3.0F - 2.0F * part);
}

}  // namespace

RT_SAFE void StyleEstimate::update(double place, double dt_s) noexcept {
  const auto at = [&](std::size_t i) -> Part& { return parts_[(oldest_ + i) % parts_.size()]; };
  if (count_ == 0 || at(count_ - 1).time_s >= kMinPart_s) at(count_++) = {};
  for (Part* const part : {&at(count_ - 1), &all_}) {
    part->sum_s += place * dt_s;
    part->time_s += dt_s;
  }
  if (count_ < 2 || all_.time_s - parts_[oldest_].time_s < kLastSecond_s) return;
  oldest_ = (oldest_ + 1) % parts_.size();
  --count_;
  all_ = {};  // anew, so that no rounding stays
  for (std::size_t i = 0; i < count_; ++i) {
    all_.sum_s += at(i).sum_s;
    all_.time_s += at(i).time_s;
  }
}

double StyleEstimate::value() const noexcept {
  if (all_.time_s < kMinKnown_s) return std::numeric_limits<double>::quiet_NaN();
  return all_.sum_s / all_.time_s;
}

RT_SAFE void Fade::step(double towards, double part) noexcept {
  if (!std::isfinite(towards)) return;
  for (double& stage : stage_) {
    stage += part * (towards - stage);
    if (std::abs(towards - stage) < kThere) stage = towards;
    towards = stage;
  }
}

RT_SAFE void Gate::update(const TrainedMotion* known, bool on, const Frame& frame,
                          std::span<const float> q, std::span<const std::uint8_t> available,
                          const Distance& distance, const std::optional<Walker>& walker,
                          double dt_s) noexcept {
  const Evidence before = seen_;
  seen_.knows = 1.0;
  if (known != nullptr) {
    speed_.update(*known, q, available, dt_s);
    see_pose(*known, distance, walker.has_value());
    see_legs(*known, frame, walker, dt_s);
    if (on) seen_.knows = of_pose_ * of_cadence_;
  }
  const bool closes = known != nullptr && on;
  fresh_ = fresh_ && !closes;
  if (fresh_) return fade_.set(1.0);
  follow(closes ? known : nullptr, before, dt_s);
}

// The arms and the trunk of a run are none of a walk's, so what replaces them must not count where
// the legs do not tell the two apart.
RT_SAFE void Gate::see_pose(const TrainedMotion& known, const Distance& distance,
                            bool is_own) noexcept {
  if (std::isnan(distance.kernel_deg)) return;
  const bool legs_tell = is_own || !known.legs() || !std::isnan(stride_.cadence_rad_s());
  const double distance_deg = legs_tell ? distance.kernel_deg : distance.whole_deg;
  of_pose_ = is_own ? 1.0 - rise(distance_deg, kOwnNear_deg, kOwnFar_deg)
                    : 1.0 - rise(distance_deg, kNear_deg, kFar_deg);
  of_near_pose_ = 1.0 - rise(distance.whole_deg, kSame_deg, kOther_deg);
}

// How far the legs stride as in training; all the way where that cannot be told.
RT_SAFE void Gate::see_legs(const TrainedMotion& known, const Frame& frame,
                            const std::optional<Walker>& walker, double dt_s) noexcept {
  leg_rad_ = std::numeric_limits<double>::quiet_NaN();
  if (!known.legs()) {
    of_legs_ = of_cadence_ = 1.0;
    seen_.swing_rad = std::numeric_limits<double>::quiet_NaN();
  }
  if (!known.legs() || !known.legs()->measured(frame)) return;
  const double leg_rad = leg_rad_ = known.legs()->value_rad(frame);
  stride_.update(leg_rad, dt_s, pace_rad_s(known));
  const double height_m = known.height_m(frame);
  if (std::isfinite(height_m)) gait_.update(height_m, leg_rad, dt_s);
  seen_.swing_rad = stride_.swing_rad();
  seen_.speed_deg_s = speed_.value_deg_s();
  const double rest = of_rest(known, seen_);
  if (rest == 1.0) {
    // The phase of legs that rest says nothing: the first steps count by their swing alone.
    stride_.forget_cadence();
    gait_.forget();
    cadence_rad_s_ = 0.0;
    rest_rad_ = stride_.angle_rad();
    of_cadence_ = 1.0;
  }
  double usual_rad_s = known.cadence_rad_s();
  if (walker && walker->cadence_rad_s > kOwnFast * usual_rad_s) {
    usual_rad_s = walker->cadence_rad_s / kOwnFast;
  }
  const double cadence_rad_s = std::abs(stride_.cadence_rad_s());
  if (!std::isnan(cadence_rad_s)) {
    if (cadence_rad_s_ == 0.0) cadence_rad_s_ = steady_rad_s_ = cadence_rad_s;
    cadence_rad_s_ -= std::expm1(-dt_s / kCadence_s) * (cadence_rad_s - cadence_rad_s_);
    steady_rad_s_ -= std::expm1(-dt_s / kSteady_s) * (cadence_rad_s_ - steady_rad_s_);
    const double ratio = cadence_rad_s_ / usual_rad_s;
    // A first step begins slowly, and slow legs turn fast and slowly within each.
    const bool begins = std::abs(stride_.angle_rad() - rest_rad_) < kFirstStep_rad;
    const double of_slow = begins ? 1.0 : rise(steady_rad_s_ / usual_rad_s, kTooSlow, kSlow);
    of_cadence_ = of_slow * (1.0 - of_run(known, ratio));
  }
  of_legs_ = (1.0 - rest) * of_cadence_;
}

// At which the legs stride; a usual one while that is not known, and for a run.
RT_SAFE double Gate::pace_rad_s(const TrainedMotion& known) const noexcept {
  const double usual_rad_s = known.cadence_rad_s();
  if (cadence_rad_s_ == 0.0) return usual_rad_s;
  return std::clamp(steady_rad_s_, kSlowestPace * usual_rad_s, usual_rad_s);
}

// 1 where legs or body rest.
RT_SAFE double Gate::of_rest(const TrainedMotion& known, const Evidence& seen) noexcept {
  const double swing = rise(seen.swing_rad, kRest * known.swing_rad(), kSwing * known.swing_rad());
  if (std::isnan(seen.speed_deg_s)) return 1.0 - swing;
  return 1.0 - swing * rise(seen.speed_deg_s, kStill_deg_s, kMoving_deg_s);
}

// 1 where the legs run and did not in training: they are quicker, or the pelvis is higher while
// they are apart, which tells most of long steps, or falls as one does without a foot on the
// ground. `cadence` is in shares of a usual one. The very poses of training are none of a run.
RT_SAFE double Gate::of_run(const TrainedMotion& known, double cadence) const noexcept {
  const double taught = known.gait_correlation();
  const double higher = gait_.correlation() - std::max(taught, kWalk);
  const double wide = rise(stride_.swing_rad() / known.swing_rad(), kUsual, kWide);
  if (!std::isnan(taught) && !std::isnan(higher)) cadence += (kOfGait + kOfWide * wide) * higher;
  const double step_rad_s = 2.0 * steady_rad_s_;
  const double fall = gait_.bounce_m() * step_rad_s * step_rad_s / kGravity_m_s2;
  if (taught < kTaughtRun) cadence += kOfFlight * rise(fall, kFalls, kFlies);
  return rise(cadence, kFast, kTooFast) * (1.0 - of_near_pose_);
}

// The evidence goes straight from frame to frame, so that legs that begin to stride open the gate
// within one.
RT_SAFE void Gate::follow(const TrainedMotion* known, const Evidence& from, double dt_s) noexcept {
  fade_.follow(dt_s, [&](double share) {
    const Evidence now{.knows = between(from.knows, seen_.knows, share),
                       .swing_rad = between(from.swing_rad, seen_.swing_rad, share),
                       .speed_deg_s = between(from.speed_deg_s, seen_.speed_deg_s, share)};
    const bool rests = known != nullptr && std::isfinite(now.swing_rad);
    return rests ? now.knows * (1.0 - of_rest(*known, now)) : now.knows;
  });
}

RT_SAFE void Gate::settle() noexcept {
  if (fresh_) fade_.set(1.0);
  stride_.turn_back();
}

RT_SAFE bool WalkerTracker::see(const BoundModel& model, const Frame& frame,
                                std::span<const float> q, std::span<const std::uint8_t> available,
                                double gap_s, double dt_s, std::span<float> input) noexcept {
  report_missing_data(model);
  const TrainedMotion* const known = model.known ? &*model.known : nullptr;
  relate(model, q, available, dt_s, input);
  Gate::Distance distance{};
  if (known != nullptr) {
    const bool seen_whole = trusts_ && !replaced_;
    distance.kernel_deg = seen_whole ? whole_deg_ : known->distance_deg(input, available);
    distance.whole_deg = trusts_ ? whole_deg_ : distance.kernel_deg;
  }
  gate_.update(known, gate_on_, frame, input, available, distance, walker_, dt_s);
  const bool jumped = measure(model, q, available, gap_s, dt_s);
  if (jumped) relate(model, q, available, 0.0, input);
  return jumped;
}

RT_SAFE double WalkerTracker::cadence_rad_s(const BoundModel& model) const noexcept {
  const double now = std::abs(gate_.smooth_cadence_rad_s());
  if (now > 0.0) return now;
  return model.known ? model.known->cadence_rad_s() : 0.0;
}

// Once a model.
RT_SAFE void WalkerTracker::report_missing_data(const BoundModel& model) noexcept {
  if (gate_on_ && !model.known && !std::exchange(reported_no_gate_, true)) report(kNoGateData);
  const bool no_axis = model.axis.size() == 0;
  if (auto_alpha_ && no_axis && !std::exchange(reported_no_axis_, true)) report(kNoAxis);
}

// The walker's cycle is set beside the neutral walk of training that is nearest to it. What sets
// the two apart at each instant is what its poses are shifted by; the mean alone where its cycle is
// not known.
RT_SAFE void WalkerTracker::adapt(const BoundModel& model) noexcept {
  adapted_ = true;
  usual_ = model.anyone ? &*model.anyone : nullptr;
  shifts_ = walker_ && !model.usual.empty() && walker_->cycle.cols() >= model.space.dims();
  if (!shifts_) return;
  const Eigen::Index dims = model.space.dims();
  const PoseCycle& own = walker_->cycle;
  float nearest = std::numeric_limits<float>::infinity();
  for (const BoundModel::Usual& one : model.usual) {
    float apart = 0.0F;
    for (Eigen::Index d = 0; d < dims; ++d) {
      if (std::isfinite(own(0, d))) apart += (one.cycle.col(d) - own.col(d)).squaredNorm();
    }
    if (apart < nearest) usual_ = &one;
    nearest = std::min(nearest, apart);
  }
  PoseCycle at = usual_->cycle;
  PoseCycle apart;
  apart.setZero(kGridFrames, dims);
  for (Eigen::Index d = 0; d < dims; ++d) {
    if (walker_->measured[static_cast<std::size_t>(d)] == 0) continue;
    if (std::isfinite(own(0, d))) {
      at.col(d) = own.col(d);
      apart.col(d) = usual_->cycle.col(d) - own.col(d);
    } else {
      apart.col(d).setConstant(usual_->cycle.col(d).mean() -
                               walker_->neutral[static_cast<std::size_t>(d)]);
    }
  }
  shift_.fit(model.leg_dims, at, apart);
}

RT_SAFE void WalkerTracker::relate(const BoundModel& model, std::span<const float> q,
                                   std::span<const std::uint8_t> available, double dt_s,
                                   std::span<float> input) noexcept {
  if (!adapted_) adapt(model);
  if (shifts_) shift_.get(q, available, input);
  for (std::size_t d = 0; d < q.size(); ++d) {
    if (shifts_) {
      input[d] += q[d];
      continue;
    }
    input[d] = q[d];
    if (!walker_ || walker_->measured[d] == 0 || model.neutral.size() == 0) continue;
    input[d] += model.neutral[static_cast<Eigen::Index>(d)] - walker_->neutral[d];
  }
  follow_trust(model, available, dt_s, input);
  replace_untrusted(model, available, input);
}

// A part that comes and goes within a few frames would snap.
RT_SAFE void WalkerTracker::follow_trust(const BoundModel& model,
                                         std::span<const std::uint8_t> available, double dt_s,
                                         std::span<const float> input) noexcept {
  const bool began = std::exchange(trusts_, usual_ != nullptr && model.known);
  if (!trusts_) return trust_.fill(1.0F);
  const Trust before = seen_trust_;
  const auto distances = model.known->distances_deg(input, available, model.loose_parts);
  whole_deg_ = distances.whole_deg;
  const auto& limits = walker_ ? kKnownWalker : kUnknownWalker;
  for (std::size_t p = 0; p < kLooseParts; ++p) {
    seen_trust_[p] = share_below(distances.part_deg[p], limits[p]);
    // Arms come before shoulders.
    const std::size_t whole = index_of(whole_part(static_cast<LoosePart>(p)));
    seen_trust_[p] = std::max(seen_trust_[p], seen_trust_[whole]);
    const auto from = static_cast<double>(before[p]);
    const auto to = static_cast<double>(seen_trust_[p]);
    if (began) {
      fades_[p].follow(dt_s, [&](double share) { return between(from, to, share); });
    } else {
      fades_[p].set(to);
    }
    trust_[p] = static_cast<float>(fades_[p].value());
  }
}

// What the legs do not explain would take the pose away from all of training, and with it the style
// of the rest of the body.
RT_SAFE void WalkerTracker::replace_untrusted(const BoundModel& model,
                                              std::span<const std::uint8_t> available,
                                              std::span<float> input) noexcept {
  replaced_ = trust_ != kAllTrust;
  if (!replaced_) return;
  std::array<float, motion::kMaxPoseDims> walk;
  usual_->does.get(input, available, walk);
  for (std::size_t d = 0; d < input.size(); ++d) {
    if (model.loose_parts[d] == LoosePart::kNone || available[d] == 0) continue;
    input[d] = walk[d] + trust(whole_part(model.loose_parts[d])) * (input[d] - walk[d]);
  }
}

// The warm-up and the estimate. Returns whether a warm-up has ended well.
RT_SAFE bool WalkerTracker::measure(const BoundModel& model, std::span<const float> q,
                                    std::span<const std::uint8_t> available, double gap_s,
                                    double dt_s) noexcept {
  const LegMotion legs = gate_.legs();
  const bool walks = legs.walk;
  const bool all = std::ranges::equal(available, model.served);
  if (model.axis.size() > 0 && walks && all) {
    double place = model.axis_offset;
    for (std::size_t d = 0; d < q.size(); ++d) {
      place += static_cast<double>(model.axis[static_cast<Eigen::Index>(d)] * q[d]);
    }
    estimate_.update(place, dt_s);
  }
  if (gap_s > kInterruption_s) interrupt();
  switch (warm_up_.update(q, available, legs, dt_s)) {
    case WarmUp::Outcome::kNone:
      return false;
    case WarmUp::Outcome::kStood:
      report(kStood);
      return false;
    case WarmUp::Outcome::kDone:
      break;
  }
  walker_ = warm_up_.walker();
  adapted_ = false;
  report(kWarmedUp);
  return true;
}

// Whether a walker can be known with this model.
RT_SAFE bool WalkerTracker::serves(const BoundModel* model) noexcept {
  if (model == nullptr) return false;
  // No reply reaches whoever wrote the config, so it is a notice.
  if (!model->known && !std::exchange(reported_no_gate_, true)) report(kNoGateData);
  return model->known.has_value();
}

RT_SAFE bool WalkerTracker::warm_up(const BoundModel* model, double seconds) noexcept {
  if (!serves(model)) return false;
  warm_up_.begin(seconds);
  return true;
}

RT_SAFE bool WalkerTracker::know(const BoundModel* model, const Walker& walker) noexcept {
  if (!serves(model)) return false;
  warm_up_.stop();
  walker_ = walker;
  adapted_ = false;
  return true;
}

RT_SAFE void WalkerTracker::interrupt() noexcept {
  if (warm_up_.running()) report(kInterrupted);
  warm_up_.stop();
}

RT_SAFE void WalkerTracker::forget() noexcept {
  interrupt();
  estimate_.forget();
  walker_.reset();
  adapted_ = false;
}

RT_SAFE void WalkerTracker::exchange(const BoundModel* from, const BoundModel& to) noexcept {
  interrupt();
  estimate_.forget();
  adapted_ = false;
  reported_no_gate_ = false;
  reported_no_axis_ = false;
  if (!walker_ || from == nullptr) return;
  if (!serves(&to)) return walker_.reset();
  if (walker_->convert(from->space, to.space)) return;
  walker_.reset();
  report(kOtherJoints);
}

RT_SAFE std::optional<StageNotice> WalkerTracker::take_notice() noexcept {
  if (pending_ == 0) return std::nullopt;
  const auto next = static_cast<std::size_t>(std::countr_zero(pending_));
  pending_ &= pending_ - 1;
  return StageNotice{.index = next};
}

}  // namespace posed::style
