#include "models/style/live/walker_tracker.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace posed::style {
namespace {

constexpr double kInterruption_s = 1.0;  // of the frames

}  // namespace

RT_SAFE bool WalkerTracker::see(const BoundModel& model, const Frame& frame,
                                std::span<const float> q, std::span<const std::uint8_t> available,
                                double gap_s, double dt_s, std::span<float> input) noexcept {
  report_missing_data(model);
  const TrainedMotion* const known = model.known ? &*model.known : nullptr;
  relate(model, q, input);
  gate_.update(known, gate_on_, frame, input, available, walker_, dt_s);
  const bool jumped = measure(model, q, available, gap_s, dt_s);
  if (jumped) relate(model, q, input);
  return jumped;
}

// Once a model.
RT_SAFE void WalkerTracker::report_missing_data(const BoundModel& model) noexcept {
  if (gate_on_ && !model.known && !std::exchange(reported_no_gate_, true)) report(kNoGateData);
  const bool no_axis = model.axis.size() == 0;
  if (auto_alpha_ && no_axis && !std::exchange(reported_no_axis_, true)) report(kNoAxis);
}

RT_SAFE void WalkerTracker::relate(const BoundModel& model, std::span<const float> q,
                                   std::span<float> input) const noexcept {
  for (std::size_t d = 0; d < q.size(); ++d) {
    input[d] = q[d];
    if (!walker_ || walker_->measured[d] == 0 || model.neutral.size() == 0) continue;
    input[d] += model.neutral[static_cast<Eigen::Index>(d)] - walker_->neutral[d];
  }
}

// The warm-up and the estimate. Returns whether a warm-up has ended well.
RT_SAFE bool WalkerTracker::measure(const BoundModel& model, std::span<const float> q,
                                    std::span<const std::uint8_t> available, double gap_s,
                                    double dt_s) noexcept {
  const bool walks = gate_.strides();
  const bool all = std::ranges::equal(available, model.served);
  if (model.axis.size() > 0 && walks && all) {
    double place = model.axis_offset;
    for (std::size_t d = 0; d < q.size(); ++d) {
      place += static_cast<double>(model.axis[static_cast<Eigen::Index>(d)] * q[d]);
    }
    estimate_.update(place, dt_s);
  }
  if (gap_s > kInterruption_s) interrupt();
  switch (warm_up_.update(q, available, walks, gate_.cadence_rad_s(), dt_s)) {
    case WarmUp::Outcome::kNone:
      return false;
    case WarmUp::Outcome::kStood:
      report(kStood);
      return false;
    case WarmUp::Outcome::kDone:
      break;
  }
  walker_ = warm_up_.walker();
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
  return true;
}

RT_SAFE void WalkerTracker::interrupt() noexcept {
  if (warm_up_.running()) report(kInterrupted);
  warm_up_.stop();
}

RT_SAFE void WalkerTracker::exchange(const BoundModel* from, const BoundModel& to) noexcept {
  interrupt();
  estimate_.forget();
  reported_no_gate_ = false;
  reported_no_axis_ = false;
  if (!walker_ || from == nullptr) return;
  if (!serves(&to)) return walker_.reset();
  Walker moved = *walker_;
  if (to.space.convert(from->space, walker_->neutral, moved.neutral)) {
    walker_ = moved;
  } else {
    walker_.reset();
    report(kOtherJoints);
  }
}

RT_SAFE std::optional<StageNotice> WalkerTracker::take_notice() noexcept {
  if (pending_ == 0) return std::nullopt;
  const auto next = static_cast<std::size_t>(std::countr_zero(pending_));
  pending_ &= pending_ - 1;
  return StageNotice{.index = next};
}

}  // namespace posed::style
