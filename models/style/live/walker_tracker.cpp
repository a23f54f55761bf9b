#include "models/style/live/walker_tracker.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace posed::style {
namespace {

constexpr double kInterruption_s = 1.0;  // of the frames

// A part of the body walks up to the first of these distances from every training pose [deg rms
// over its joints], and does something else from the second on: README.md, "Busy limbs".
struct Limits {
  float walks, other;
};
constexpr Limits kNone{1e9F, 2e9F};
// In the order of BodyPart.
constexpr std::array<Limits, kBodyParts> kUnknownWalker{
    {{14.0F, 20.0F}, {16.0F, 24.0F}, {36.0F, 48.0F}, {36.0F, 48.0F}, kNone, kNone}};
constexpr std::array<Limits, kBodyParts> kKnownWalker{
    {{7.0F, 13.0F}, {8.0F, 14.0F}, {12.0F, 20.0F}, {12.0F, 20.0F}, kNone, kNone}};

float share_below(float value, const Limits& limits) noexcept {
  const float part = std::clamp((limits.other - value) / (limits.other - limits.walks), 0.0F, 1.0F);
  return part * part * (3.0F - 2.0F * part);
}

}  // namespace

RT_SAFE bool WalkerTracker::see(const BoundModel& model, const Frame& frame,
                                std::span<const float> q, std::span<const std::uint8_t> available,
                                double gap_s, double dt_s, std::span<float> input) noexcept {
  report_missing_data(model);
  const TrainedMotion* const known = model.known ? &*model.known : nullptr;
  relate(model, q, available, input);
  const std::span<const float> whole =
      replaced_ ? std::span<const float>(whole_.data(), q.size()) : input;
  gate_.update(known, gate_on_, frame, input, whole, available, walker_, dt_s);
  const bool jumped = measure(model, q, available, gap_s, dt_s);
  if (jumped) relate(model, q, available, input);
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
                                   std::span<const std::uint8_t> available,
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
  replace_untrusted(model, available, input);
}

// What the legs do not explain would take the pose away from all of training, and with it the style
// of the rest of the body.
RT_SAFE void WalkerTracker::replace_untrusted(const BoundModel& model,
                                              std::span<const std::uint8_t> available,
                                              std::span<float> input) noexcept {
  trust_.fill(1.0F);
  replaced_ = false;
  if (usual_ == nullptr || !model.known) return;
  const auto distances = model.known->part_distances_deg(input, available, model.loose_parts);
  const auto& limits = walker_ ? kKnownWalker : kUnknownWalker;
  for (std::size_t p = 0; p < kBodyParts; ++p) trust_[p] = share_below(distances[p], limits[p]);
  if (std::ranges::all_of(trust_, [](float trust) { return trust == 1.0F; })) return;
  replaced_ = true;
  std::ranges::copy(input, whole_.begin());
  std::array<float, motion::kMaxPoseDims> walk;
  usual_->does.get(input, available, walk);
  for (std::size_t d = 0; d < input.size(); ++d) {
    if (model.loose_parts[d] == TrainedMotion::kNoPart || available[d] == 0) continue;
    input[d] = walk[d] + trust_[model.loose_parts[d]] * (input[d] - walk[d]);
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
