#include "models/smooth/adaptive_window.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include "models/smooth/live_options.hpp"
#include "models/smooth/speed_prior.hpp"
#include "proto/frame/degree.hpp"

namespace posed::smooth {
namespace {

constexpr double kDegree2 = kDegree * kDegree;  // [rad^2]

// The constants of models/smooth/README.md, "Speed-adaptive prior".
constexpr double kFirstDensity = 8000.0 * kDegree2;  // of the first solve [rad^2/s^3]
constexpr double kDensityBase = 5.0 * kDegree2;      // [rad^2/s^3]
constexpr double kDensitySlope = 15.0;               // [1/s], times the squared speed
constexpr double kDeltaBase = 0.03 * kDegree2;       // [rad^2/s]
constexpr double kDeltaSlope = 0.13;                 // [s], times the squared speed
constexpr double kSpeedReach_s = 0.08;  // the speed is averaged over this time on each side
constexpr double kHandShare = 0.1;      // of the mean speed of all channels
constexpr int kPasses = 2;
constexpr double kRepeats = 4.0;  // variance of a value equal to the one before, per variance

constexpr double kWholeRounding = 1.25;  // rounding_rad is slightly below the error of rounding
constexpr double kJump2 = 25.0;    // square of a change that is none of the noise, per variance
constexpr double kOfTurn = 6.0;    // variance of a second difference of white noise
constexpr int kSinceRepeated = 8;  // frames after which the device is taken to repeat no more

constexpr double kEven = 1e-3;  // frames whose skew is below this count as evenly spaced

constexpr int kEvenWindow = 26;
constexpr double kWindow_s = 26.0 / kEvenRate_hz;
constexpr int kLengthSlack = 8;  // the window's length over the loss that it does not follow

RT_SAFE double share_of(const Sensors& sensors, std::size_t channel) noexcept {
  return sensors.share.empty() ? 1.0 : sensors.share[channel];
}

RT_SAFE bool shown_again(const Sensors& sensors, std::size_t channel) noexcept {
  return sensors.repeated || (!sensors.again.empty() && sensors.again[channel] != 0);
}

RT_SAFE double rounded_rad2(const Sensors& sensors, std::size_t channel) noexcept {
  const double rounding_rad = sensors.rounding_rad.empty() ? 0.0 : sensors.rounding_rad[channel];
  return rounding_rad * rounding_rad;
}

}  // namespace

RT_SAFE int window_frames(double period_s) noexcept {
  if (period_s <= 0.0) return kEvenWindow;
  return std::clamp(static_cast<int>(std::lround(kWindow_s / period_s)), kEvenWindow, kMaxWindow);
}

AdaptiveWindow::AdaptiveWindow(int channels)
    : channels_(channels),
      information_(channels, kMaxWindow),
      sensed_(2 * kMaxWindow * information_.stride(), 1.0),
      window_(channels, kMaxWindow),
      past_(information_.stride()),
      steady_(channels, information_.stride(), kMaxWindow),
      jump_(trajectory::make_rows(kMaxWindow, information_.stride())),
      jumps_(kMaxWindow),
      recent_rad_(2 * static_cast<std::size_t>(channels)),
      whole_(kMaxWindow),
      ring_time_s_(kMaxWindow),
      last_measured_(channels),
      held_rad_(channels),
      variance_rad2_(channels),
      active_(trajectory::make_rows(1, information_.stride())),
      speeds_(trajectory::make_rows(kMaxWindow + 1, information_.stride())),
      density_(trajectory::make_rows(1, information_.stride())),
      hand_speeds_(kMaxWindow + 1),
      time_s_(kMaxWindow),
      step_s_(kMaxWindow),
      skew_(kMaxWindow),
      rows_(kMaxWindow) {
  reset();
}

RT_SAFE void AdaptiveWindow::reset() noexcept {
  pushed_ = 0;
  since_repeated_ = 0;
  frames_ = length_ = 0;
  std::ranges::fill(last_measured_, -1);
  std::ranges::fill(held_rad_, 0.0);
  std::fill_n(active_.get(), stride(), 0.0);
  std::fill_n(density_.get(), stride(), kDensityBase);
  std::ranges::fill(recent_rad_, std::numeric_limits<double>::quiet_NaN());
  past_.forget();
  steady_.reset();
}

RT_SAFE int AdaptiveWindow::slot(int index) const noexcept {
  assert(index >= 0 && index < frames_);
  return static_cast<int>((pushed_ - frames_ + index) % kMaxWindow);
}

RT_SAFE bool AdaptiveWindow::known(int channel) const noexcept {
  const long when = last_measured_[channel];
  return when >= 0 && when >= pushed_ - frames_;
}

RT_SAFE void AdaptiveWindow::push(double time_s, std::span<const double> measured_rad,
                                  const Sensors& sensors) noexcept {
  const int at = static_cast<int>(pushed_ % kMaxWindow);
  ring_time_s_[at] = time_s;
  information_.clear(at);
  whole_[at] = 1;
  double* const position = sensed_.data() + static_cast<std::ptrdiff_t>(2 * at) * stride();
  double* const mean = position + stride();
  for (std::size_t c = 0; c < static_cast<std::size_t>(channels_); ++c) {
    const double rounding_rad = sensors.rounding_rad.empty() ? 0.0 : sensors.rounding_rad[c];
    const bool only_rounded =
        !sensors.half_step_rad.empty() && std::isfinite(sensors.half_step_rad[c]);
    const double own_rad = share_of(sensors, c) * sensors.noise_rad;
    const double noise_rad =
        only_rounded ? kWholeRounding * rounding_rad : std::max(own_rad, rounding_rad);
    const double precision = 1.0 / (noise_rad * noise_rad);
    variance_rad2_[c] = 1.0 / precision;
    const bool measured = std::isfinite(measured_rad[c]);
    // A sensor with a dead band repeats its value while the joint moves on within the band. What
    // rounding makes of a slow motion is as near as its other values are.
    const bool repeats = last_measured_[c] >= 0 && measured_rad[c] == held_rad_[c];
    const double share = repeats && rounding_rad == 0.0 ? 1.0 / kRepeats : 1.0;
    if (!measured) whole_[at] = 0;
    if (measured) {
      if (last_measured_[c] < 0 && pushed_ > 0) adopt(c, measured_rad[c]);
      if (last_measured_[c] >= 0 && !repeats) active_[c] = 1.0;
      held_rad_[c] = measured_rad[c];
      last_measured_[c] = pushed_;
    }
    // With zero precision, a channel that is missing in the whole window would have no value.
    position[c] = measured && !shown_again(sensors, c) ? share * precision : kNothing;
    mean[c] = position[c] * held_rad_[c];
  }
  copy_sensed(at);
  find_jumps(measured_rad, sensors);
  ++pushed_;
  steady_.push(time_s, measured_rad,
               {.variance_rad2 = variance_rad2_.data(),
                .density = density_.get(),
                .active = active_.get(),
                .repeated = sensors.repeated,
                .again = sensors.again});
}

// A change of speed from frame to frame that noise cannot explain is one of the joint, as bad
// samples are left out before (models/gate). So the prior of the frame before has to allow for it:
// its variance there is larger by the change's square. A value that repeats is that of a dead band,
// whose changes say nothing.
RT_SAFE void AdaptiveWindow::find_jumps(std::span<const double> measured_rad,
                                        const Sensors& sensors) noexcept {
  since_repeated_ = sensors.repeated ? 0 : std::min(since_repeated_ + 1, kSinceRepeated);
  const std::size_t before = (pushed_ + kMaxWindow - 1) % kMaxWindow;
  double* const jump = jump_row(static_cast<int>(before));
  jumps_[pushed_ % kMaxWindow] = 0;
  std::fill_n(jump, stride(), 0.0);
  for (std::size_t c = 0; c < static_cast<std::size_t>(channels_); ++c) {
    const double now = measured_rad[c];
    const double last = std::exchange(recent_rad_[2 * c], now);
    const double first = std::exchange(recent_rad_[2 * c + 1], last);
    const double turn_rad = now - 2.0 * last + first;
    const double noise_rad = share_of(sensors, c) * sensors.jitter_rad;
    const double most_rad2 =
        kJump2 *
        std::min(variance_rad2_[c], std::max(noise_rad * noise_rad, rounded_rad2(sensors, c)));
    const bool moves = now != last && last != first && since_repeated_ == kSinceRepeated &&
                       sensors.jitter_rad > 0.0;
    if (!(turn_rad * turn_rad > kOfTurn * most_rad2) || !moves) continue;
    jump[c] = turn_rad * turn_rad;
    jumps_[before] = 1;
  }
}

RT_SAFE void AdaptiveWindow::allow_jumps(int index) noexcept {
  const int at = slot(index);
  if (jumps_[at] == 0) return;
  const double* const jump = jump_row(at);
  double* const curve = information_.row(at, trajectory::kDeltaDelta);
  for (int c = 0; c < channels_; ++c) {
    if (jump[c] > 0.0) curve[c] = 1.0 / (1.0 / curve[c] + jump[c]);
  }
}

RT_SAFE void AdaptiveWindow::copy_sensed(int slot) noexcept {
  std::copy_n(sensed(slot), stride(), information_.row(slot, trajectory::kPosition));
  std::copy_n(sensed(slot) + stride(), stride(), information_.row(slot, trajectory::kPositionMean));
}

// Sets the earlier frames of a channel that is measured for the first time to its value, so that
// nothing pulls it away from where it starts.
RT_SAFE void AdaptiveWindow::adopt(std::size_t channel, double value_rad) noexcept {
  const long from = std::max<long>(0, pushed_ - kMaxWindow + 1);
  for (long i = from; i < pushed_; ++i) {
    const int at = static_cast<int>(i % kMaxWindow);
    sensed_[static_cast<std::size_t>((2 * at + 1) * stride()) + channel] = kNothing * value_rad;
    copy_sensed(at);
  }
}

// Collects the window's frames and the times between them.
RT_SAFE void AdaptiveWindow::begin(double period_s) noexcept {
  period_s_ = period_s > 0.0 ? period_s : 1.0 / kEvenRate_hz;
  // The period of frames with jitter is never the same twice, and a window that loses more than one
  // frame at a time loses its past, too. So it grows at once, and shrinks only if that is by much.
  const int wanted = window_frames(period_s);
  if (wanted > length_ || wanted < length_ - length_ / kLengthSlack) length_ = wanted;
  frames_ = static_cast<int>(std::min<long>(pushed_, length_));
  past_.begin(pushed_ - frames_);
  for (int i = 0; i < frames_; ++i) {
    const std::size_t index = i;
    rows_[index] = information_.frame(slot(i));
    time_s_[index] = ring_time_s_[slot(i)];
    step_s_[index] = i > 0 ? time_s_[index] - time_s_[index - 1] : 0.0;
  }
  even_ = true;
  for (int i = 1; i + 1 < frames_; ++i) {
    const std::size_t index = i;
    const double before_s = step_s_[index];
    const double after_s = step_s_[index + 1];
    skew_[index] = (after_s - before_s) / (after_s + before_s);
    even_ = even_ && std::abs(skew_[index]) < kEven;
  }
}

// Removes the information that InformationSource added for the last solve. The precisions of delta
// and delta-delta are rewritten for each solve; their means are zero otherwise.
RT_SAFE void AdaptiveWindow::forget_extra() noexcept {
  if (!std::exchange(extra_, false)) return;
  for (int i = 0; i < frames_; ++i) {
    copy_sensed(slot(i));
    std::fill_n(information_.row(slot(i), trajectory::kDeltaMean), stride(), 0.0);
    std::fill_n(information_.row(slot(i), trajectory::kDeltaDeltaMean), stride(), 0.0);
  }
}

RT_SAFE void AdaptiveWindow::loose_prior() noexcept {
  for (int i = 1; i + 1 < frames_; ++i) {
    const double curve = 1.0 / (kFirstDensity * delta_delta_time_s3(i));
    std::fill_n(information_.row(slot(i), trajectory::kDelta), 2 * stride(), 0.0);
    std::fill_n(information_.row(slot(i), trajectory::kDeltaDelta), stride(), curve);
    std::fill_n(information_.row(slot(i), trajectory::kDeltaDeltaMean), stride(), 0.0);
    allow_jumps(i);
  }
}

RT_SAFE void AdaptiveWindow::speed_prior() noexcept {
  kernel::sum_speeds(window_.x(0), frames_, stride(), step_s_.data(), active_.get(), speeds_.get(),
                     hand_speeds_.data());
  double active = 0.0;
  for (int c = 0; c < channels_; ++c) active += active_[c];
  const double reach_s = kSpeedReach_s + 0.5 * period_s_;
  int from = 0;
  int to = 0;  // frames from <= j < to are within the averaging time
  for (int i = 1; i + 1 < frames_; ++i) {
    const auto at = [this](int index) { return time_s_[index]; };
    while (at(from) < at(i) - reach_s) ++from;
    while (to < frames_ && at(to) <= at(i) + reach_s) ++to;
    // Frame j represents the step before it; the first frame represents the step after it.
    const double first_s = from > 0 ? at(from - 1) : at(0) - step_s_[1];
    const double per_s = 1.0 / (at(to - 1) - first_s);
    const double hand = hand_speeds_[to] - hand_speeds_[from];
    const double delta_s = 0.5 * (step_s_[i] + step_s_[static_cast<std::size_t>(i) + 1]);
    const kernel::Speed speed{.per_s = (1.0 - kHandShare) * per_s,
                              .hand = active > 0.0 ? kHandShare * hand * per_s / active : 0.0};
    const kernel::Spread spread{.delta_base = kDeltaBase * delta_s,
                                .delta_slope = kDeltaSlope * delta_s,
                                .density_base = kDensityBase,
                                .density_slope = kDensitySlope,
                                .delta_delta_s3 = delta_delta_time_s3(i)};
    const kernel::Steady steady{.loose = steady_.loose(frames_ - 1 - i),
                                .root = SteadyMotion::kDensityRoot};
    const auto row = [this](int index) {
      return speeds_.get() + static_cast<std::ptrdiff_t>(index) * stride();
    };
    kernel::set_precision(row(from), row(to), stride(), speed, spread, steady,
                          {.delta = information_.row(slot(i), trajectory::kDelta),
                           .delta_delta = information_.row(slot(i), trajectory::kDeltaDelta),
                           .density = density_.get()});
    allow_jumps(i);
  }
}

RT_SAFE void AdaptiveWindow::run(const trajectory::Carry& carry) noexcept {
  window_.solve({rows_.data(), static_cast<std::size_t>(frames_)}, trajectory::Boundary::kDrop,
                even_ ? nullptr : skew_.data(), carry);
}

RT_SAFE void AdaptiveWindow::solve_once(double period_s) noexcept {
  begin(period_s);
  loose_prior();
  run(past_.incoming());
}

RT_SAFE void AdaptiveWindow::solve(double period_s, InformationSource* extra) noexcept {
  solve_once(period_s);
  if (frames_ < 3) return;  // too few frames for a delta window: only the first solve is done
  for (int pass = 0; pass < kPasses; ++pass) {
    speed_prior();
    forget_extra();
    if (extra != nullptr) {
      extra->add(*this);
      extra_ = true;
    }
    run(pass + 1 < kPasses ? past_.incoming() : past_.incoming_and_outgoing());
  }
  forget_extra();
}

// Variance of the delta-delta divided by Q: dt^3 for even frames (models/smooth/README.md, "Uneven
// frames").
RT_SAFE double AdaptiveWindow::delta_delta_time_s3(int index) const noexcept {
  const double before_s = step_s_[index];
  const double after_s = step_s_[static_cast<std::size_t>(index) + 1];
  return 2.0 * before_s * before_s * after_s * after_s / (before_s + after_s);
}

}  // namespace posed::smooth
