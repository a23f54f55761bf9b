#include "models/smooth/noise_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "proto/frame/degree.hpp"

namespace posed::smooth {
namespace {

constexpr double kFirstGuess_rad = 1.0 * kDegree;  // used until there are enough values
constexpr double kMinNoise_rad = 0.02 * kDegree;
constexpr double kMinBin_rad = 1e-6;   // the first bin's lower edge
constexpr double kLastBin_rad = 16.0;  // and the last one's: larger sizes count there
constexpr double kEnough = 40.0;       // values needed before the median is used
constexpr double kMemory = 12000.0;    // values; when reached, all counts are halved
constexpr double kLowSide = 0.97;
// The median of |third difference| of white noise is 0.6745 standard deviations, and that standard
// deviation is sqrt(20) times the noise.
constexpr double kMedian = 0.6745;
constexpr double kToNoise = kLowSide / (kMedian * 4.47213595499958);

// Noise of a channel beside the common one.
constexpr double kOwnSpread = 0.35;         // octaves that equally noisy channels seem to differ by
constexpr double kLowShare = 0.3;           // of a channel's differences: more may be motion
constexpr double kLowOverMedian = 0.57127;  // of the sizes of normal values
constexpr double kOwnFew = 100.0;           // values that count as much as the common noise
constexpr double kOwnStep = 0.01;           // least step of a level, of itself
constexpr double kMaxOctaves = 6.0;
constexpr double kFastMotion = 0.7;  // tenth differences over third ones, as of white noise
constexpr double kTenthOverThird = 96.1134434;  // sqrt(184756 / 20), of white noise
constexpr long kSamplesALook = 8;               // samples between two looks at a channel

// Correlation of the noise.
constexpr double kFew = 400.0;               // differences before a correlation is believed
constexpr double kFewWhite = 120.0;          // the same before noise is called white
constexpr double kMinCorrelation = 0.3;      // less is taken for white noise
constexpr double kStillWhite = 0.4;          // and so much, what has been taken for white noise
constexpr double kMaxCorrelation = 0.85;     // more cannot be told apart
constexpr double kMotionShare = 1.0 / 15.0;  // of the rate: the noise up to there counts
constexpr double kSlowest_Hz = 40.0;         // of samples whose noise differs from motion
constexpr double kOverRounding = 2.0;        // a weaker noise is that of the steps, and not random

// Steps of quantisation.
constexpr double kSmallest_rad = 1e-5;  // float values differ by less
constexpr double kSame = 0.02;          // tolerance, of a step
constexpr double kStepForget = 0.02;    // of a change
constexpr int kStepChanges = 4;         // before a step is believed
constexpr int kMostChanges = 100;       // that are counted
constexpr double kStepShare = 0.9;      // of the changes that are multiples of the step
constexpr double kRounding = 0.8 * 0.28867513459481287;  // of a step: slightly below 1/sqrt(12)

// Noise beside the rounding.
constexpr int kTurnFrames = 3;             // in which a change is taken back
constexpr double kTurnForget = 0.05;       // of a change
constexpr double kFirstTurns = 0.1;        // share of such changes that is assumed at first
constexpr double kFewTurns = 0.15;         // share that motions have
constexpr double kLeastRounded = 1.25;     // times kRounding: the noise of rounded values
constexpr double kMoreThanRounding = 2.2;  // times kRounding: that of more than rounding
constexpr double kUnbounded = std::numeric_limits<double>::infinity();

// Repeated samples.
constexpr double kSamples = 100.0;     // that the shares are means of
constexpr double kFirstSamples = 8.0;  // before repeats are believed
constexpr double kAlone = 0.2;         // most channels that repeat while others change
constexpr double kCommon = 0.3;        // least share of samples that are shown so often
constexpr int kFewChannels = 3;        // fewer may well repeat by chance
constexpr double kFewSamples = 16.0;   // of a channel, before its repeats are believed
constexpr double kRegular = 0.7;       // share of samples that are shown as long as the one before

// Variance of the tenth difference of noise of variance 1 whose samples have the correlation r,
// r^2, r^3, ...
double tenth_variance(double r) noexcept {
  constexpr std::array kPowers{2.0,     -40.0,     380.0,    -2280.0,   9690.0,  -31008.0,
                               77520.0, -155040.0, 251940.0, -335920.0, 184756.0};
  double sum = 0.0;
  for (const double factor : kPowers) sum = sum * r + factor;
  return sum;
}

// The tenth difference [rad] of a sample and of those before it, newest first, each `apart` samples
// before the one that follows it.
double tenth_difference(double now_rad, const double* past, int apart) noexcept {
  const auto at = [&](int back) { return past[back * apart - 1]; };
  return std::abs(now_rad + at(10) - 10.0 * (at(1) + at(9)) + 45.0 * (at(2) + at(8)) -
                  120.0 * (at(3) + at(7)) + 210.0 * (at(4) + at(6)) - 252.0 * at(5));
}

}  // namespace

RT_SAFE void MedianSize::count(double size_rad) noexcept {
  const double octaves = size_rad > kMinBin_rad ? std::log2(size_rad / kMinBin_rad) : 0.0;
  const int bin = std::min(static_cast<int>(octaves * kBinsAnOctave), kBins - 1);
  bins_[static_cast<std::size_t>(bin)] += 1.0;
  total_ += 1.0;
}

RT_SAFE void MedianSize::fade() noexcept {
  if (total_ < kMemory) return;
  for (double& bin : bins_) bin *= 0.5;
  total_ *= 0.5;
}

RT_SAFE void MedianSize::reset() noexcept {
  bins_.fill(0.0);
  total_ = 0.0;
}

RT_SAFE double MedianSize::median_rad() const noexcept {
  double below = 0.0;
  int bin = 0;
  for (; bin < kBins - 1; ++bin) {
    const double here = bins_[static_cast<std::size_t>(bin)];
    if (below + here >= 0.5 * total_) break;
    below += here;
  }
  const double here = bins_[static_cast<std::size_t>(bin)];
  const double inside = here > 0.0 ? (0.5 * total_ - below) / here : 0.5;
  return kMinBin_rad * std::exp2((bin + inside) / kBinsAnOctave);
}

NoiseEstimate::NoiseEstimate(int channels)
    : past_(kPast * channels),
      first_(channels),
      moved_(channels),
      steps_(channels),
      levels_(channels),
      shown_(channels),
      again_(channels),
      share_(channels),
      rounding_rad_(channels),
      half_step_rad_(channels) {
  reset();
}

RT_SAFE void NoiseEstimate::reset() noexcept {
  std::ranges::fill(first_, std::numeric_limits<double>::quiet_NaN());
  std::fill(moved_.begin(), moved_.end(), false);
  std::ranges::fill(steps_, Step());
  std::ranges::fill(levels_, Level());
  std::ranges::fill(shown_, Shown());
  std::ranges::fill(again_, 0);
  std::ranges::fill(share_, 1.0);
  std::ranges::fill(rounding_rad_, 0.0);
  std::ranges::fill(half_step_rad_, kUnbounded);
  forget_differences();
  number_ = 0;
  samples_ = alone_ = 0.0;
  longer_.fill(0.0);
  run_ = 0;
  repeats_ = repeated_ = false;
  noise_rad_ = jitter_rad_ = kFirstGuess_rad;
  white_ = false;
}

// A device that is read more often than it samples repeats all its channels at once, and regularly.
// Channels that stay within their step or dead band repeat alone, and a hand that rests is still
// for long.
RT_SAFE void NoiseEstimate::judge_repeat(std::span<const double> measured_rad) noexcept {
  int moving = 0;
  int same = 0;
  for (std::size_t c = 0; c < measured_rad.size(); ++c) {
    if (!moved_[c] || !std::isfinite(measured_rad[c])) continue;
    ++moving;
    if (measured_rad[c] == past_[c * kPast]) ++same;
  }
  repeated_ = false;
  if (moving < kFewChannels) return;
  if (same == moving) {
    run_ = std::min(run_ + 1, kMaxRepeats + 1);
    repeated_ = repeats_ && run_ <= kMaxRepeats && longer_[run_ - 1] > kCommon;
    return;
  }
  samples_ = std::min(samples_ + 1.0, kSamples);
  alone_ += (static_cast<double>(same) / moving - alone_) / samples_;
  for (int i = 0; i < kMaxRepeats; ++i) {
    longer_[i] += ((run_ > i ? 1.0 : 0.0) - longer_[i]) / samples_;
  }
  run_ = 0;
  const bool repeats = samples_ > kFirstSamples && alone_ < kAlone && longer_[0] > kCommon;
  if (std::exchange(repeats_, repeats) == repeats) return;
  forget_differences();
  std::ranges::fill(levels_, Level());  // those of repeated values say nothing of the samples
  std::ranges::fill(shown_, Shown());
  std::ranges::fill(share_, 1.0);
}

RT_SAFE void NoiseEstimate::forget_differences() noexcept {
  third_.reset();
  tenth_.reset();
  far_tenth_.reset();
  even_samples_ = 0;
}

// A channel that is read more often than it is sampled repeats regularly; what stays within a dead
// band does not, and values in steps may, in a steady motion.
RT_SAFE bool NoiseEstimate::shown_again(std::size_t c, double change_rad) noexcept {
  Shown& shown = shown_[c];
  if (change_rad == 0.0) {
    shown.run = std::min(shown.run + 1, kMaxRepeats + 1);
    return shown.more_than_once && shown.run <= kMaxRepeats;
  }
  if (!std::isfinite(change_rad)) return false;
  const bool alike = shown.run == shown.last_run && shown.run <= kMaxRepeats;
  shown.samples = std::min(shown.samples + 1.0, kSamples);
  shown.repeated += ((shown.run > 0 ? 1.0 : 0.0) - shown.repeated) / shown.samples;
  shown.alike += ((alike ? 1.0 : 0.0) - shown.alike) / shown.samples;
  shown.even = alike || !shown.more_than_once ? std::min(shown.even + 1, kPast) : 0;
  shown.last_run = std::exchange(shown.run, 0);
  const bool more = shown.samples > kFewSamples && shown.repeated > kCommon &&
                    shown.alike > kRegular && rounding_rad_[c] == 0.0;
  if (std::exchange(shown.more_than_once, more) == more) return false;
  forget_differences();  // those of repeated values say nothing of the samples
  levels_[c] = Level();
  share_[c] = 1.0;
  return false;
}

// Noise beside the rounding makes a value that lies between two steps go to and fro; a motion alone
// hardly ever turns within a few frames.
RT_SAFE void NoiseEstimate::learn_step(std::size_t c, double change_rad) noexcept {
  const double size_rad = std::abs(change_rad);
  Step& step = steps_[c];
  step.frames = std::min(step.frames + 1, kTurnFrames + 1);
  if (!(size_rad > kSmallest_rad)) return;
  if (step.changes == 0 || size_rad < (1.0 - kSame) * step.least_rad) {
    step = {.least_rad = size_rad, .multiples = 1.0, .changes = 0, .turns = kFirstTurns};
  }
  const bool turned = step.last_rad * change_rad < 0.0 && step.frames <= kTurnFrames;
  step.turns += kTurnForget * ((turned ? 1.0 : 0.0) - step.turns);
  step.last_rad = change_rad;
  step.frames = 0;
  const double multiple = size_rad / step.least_rad;
  const bool whole = std::abs(multiple - std::round(multiple)) < 2.0 * kSame;
  step.changes = std::min(step.changes + 1, kMostChanges);
  step.multiples +=
      std::max(kStepForget, 1.0 / (step.changes + 1)) * ((whole ? 1.0 : 0.0) - step.multiples);
  const bool believed = step.changes >= kStepChanges && step.multiples > kStepShare;
  rounding_rad_[c] = believed ? kRounding * step.least_rad : 0.0;
  // A fast motion does not turn, whatever the noise.
  const bool noisy =
      levels_[c].values > kOwnFew && share_[c] * jitter_rad_ > kMoreThanRounding * rounding_rad_[c];
  const bool only = believed && step.turns < kFewTurns && !noisy;
  half_step_rad_[c] = only ? 0.5 * step.least_rad : kUnbounded;
}

RT_SAFE void NoiseEstimate::learn_differences(std::size_t c, double now_rad) noexcept {
  const double* const past = past_.data() + c * kPast;
  const double third = now_rad - 3.0 * past[0] + 3.0 * past[1] - past[2];
  const int even =
      shown_[c].more_than_once ? std::min(shown_[c].even, even_samples_) : even_samples_;
  if (even < 3 || !std::isfinite(third)) return;
  third_.count(std::abs(third));
  if (even < kPast / 2) return;
  const double near = tenth_difference(now_rad, past, 1);
  if (!std::isfinite(near)) return;
  learn_level(c, std::abs(third), near);
  // Differences of samples that follow each other say nearly the same: every second one counts.
  if (even < kPast || number_ % 2 != 0) return;
  const double far = tenth_difference(now_rad, past, 2);
  if (!std::isfinite(far)) return;
  tenth_.count(near);
  far_tenth_.count(far);
}

// A fast motion has third differences of its own, but hardly any tenth ones. So may many
// of a channel that moves often: a low quantile is followed.
RT_SAFE void NoiseEstimate::learn_level(std::size_t c, double third_rad,
                                        double tenth_rad) noexcept {
  Level& level = levels_[c];
  if (third_.total() < kEnough) return;
  if (level.values == 0.0) {
    level.third_rad = kLowOverMedian * third_.median_rad();
    level.tenth_rad = kTenthOverThird * level.third_rad;
  }
  level.values += 1.0;
  const double step = std::max(kOwnStep, 1.0 / (level.values + 1.0));
  const double up = 1.0 + 2.0 * kLowShare * step;
  const double down = 1.0 / (1.0 + 2.0 * (1.0 - kLowShare) * step);
  level.third_rad *= third_rad > level.third_rad ? up : down;
  level.tenth_rad *= tenth_rad > level.tenth_rad ? up : down;
  level.third_rad = std::max(level.third_rad, kMinBin_rad);
  level.tenth_rad = std::max(level.tenth_rad, kMinBin_rad);
}

// A channel that seems to differ by little is as noisy as all.
RT_SAFE double NoiseEstimate::own_share(std::size_t c, double common_rad) const noexcept {
  const Level& level = levels_[c];
  if (level.values == 0.0) return 1.0;
  const double size_rad = std::min(level.third_rad, level.tenth_rad / kTenthOverThird);
  // Differences of rounded values are often zero.
  const double own_rad = std::max(
      {kMinNoise_rad, kLeastRounded * rounding_rad_[c], kToNoise / kLowOverMedian * size_rad});
  const double off = std::clamp(std::log2(own_rad / common_rad), -kMaxOctaves, kMaxOctaves);
  const double known = level.values / (level.values + kOwnFew);
  return std::exp2(known * off * off * off / (off * off + kOwnSpread * kOwnSpread));
}

RT_SAFE void NoiseEstimate::push(std::span<const double> measured_rad, bool even,
                                 double period_s) noexcept {
  std::ranges::fill(again_, 0);
  judge_repeat(measured_rad);
  if (repeated_) return;
  ++number_;
  even_samples_ = even ? std::min(even_samples_ + 1, kPast) : 0;
  int frames = 1;  // for each sample of the channel that is sampled least
  for (std::size_t c = 0; c < measured_rad.size(); ++c) {
    const double now = measured_rad[c];
    if (std::isnan(first_[c])) first_[c] = now;
    if (std::isfinite(now) && now != first_[c]) moved_[c] = true;
    double* const past = past_.data() + c * kPast;
    const bool again = !repeats_ && shown_again(c, now - past[0]);
    if (shown_[c].more_than_once) frames = std::max(frames, 1 + shown_[c].last_run);
    if (again) {
      again_[c] = 1;
      continue;
    }
    learn_step(c, now - past[0]);
    if (moved_[c]) learn_differences(c, now);
    std::copy_backward(past, past + kPast - 1, past + kPast);
    past[0] = now;
  }
  if (third_.total() >= kEnough) {
    const double third_rad = third_.median_rad();
    const double tenth_rad = tenth_.median_rad();
    const double far_rad = tenth_rad / kTenthOverThird;
    const bool fast =
        tenth_.total() >= kEnough && tenth_rad < kLastBin_rad && far_rad < kFastMotion * third_rad;
    const double white_rad = kToNoise * (fast ? far_rad : third_rad);
    const bool random = white_rad > kOverRounding * std::ranges::max(rounding_rad_);
    const double r = random && tenth_.total() >= kFewWhite ? correlation() : kMaxCorrelation;
    jitter_rad_ = std::max(kMinNoise_rad, white_rad);
    for (auto c = static_cast<std::size_t>(number_ % kSamplesALook); c < share_.size();
         c += kSamplesALook) {
      share_[c] = own_share(c, jitter_rad_);
    }
    noise_rad_ = std::max(jitter_rad_, random ? correlated_rad(r, frames * period_s) : 0.0);
    // Once it is white it stays so until it is clearly not.
    white_ = !repeats_ && frames == 1 && r < (white_ ? kStillWhite : kMinCorrelation);
  }
  third_.fade();
  tenth_.fade();
  far_tenth_.fade();
}

// That of samples that follow each other, 0 to kMaxCorrelation, if it falls off as a first order's.
RT_SAFE double NoiseEstimate::correlation() const noexcept {
  const double ratio = far_tenth_.median_rad() / tenth_.median_rad();
  double low = 0.0;  // between these correlations the variances have this ratio
  double high = kMaxCorrelation;
  for (int i = 0; i < 12; ++i) {
    const double r = 0.5 * (low + high);
    (tenth_variance(r * r) < ratio * ratio * tenth_variance(r) ? low : high) = r;
  }
  return low;
}

// White noise of this strength has, up to the frequencies of motions, as much power as the noise;
// 0 for noise that is not correlated.
RT_SAFE double NoiseEstimate::correlated_rad(double r, double period_s) const noexcept {
  double frames = 1.0;  // for each sample
  for (const double share : longer_) frames += repeats_ ? share : 0.0;
  const double sample_s = period_s * frames;
  if (tenth_.total() < kFew || sample_s * kSlowest_Hz > 1.0 || r < kMinCorrelation) return 0.0;
  const double turn = 2.0 * std::numbers::pi * kMotionShare;
  const double power = (1.0 - r * r) / (1.0 - 2.0 * r * std::cos(turn) + r * r);
  return tenth_.median_rad() / kMedian * std::sqrt(power / tenth_variance(r));
}

}  // namespace posed::smooth
