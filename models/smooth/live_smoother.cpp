#include "models/smooth/live_smoother.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "models/smooth/adaptive_window.hpp"
#include "models/smooth/frame_clock.hpp"
#include "models/smooth/model_prior.hpp"
#include "models/smooth/noise_estimate.hpp"
#include "models/smooth/unwrap.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::smooth {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::infinity();
constexpr double kForgetAfter_s = 1.0;  // after a longer silence the past is forgotten
constexpr int kMaxPending = static_cast<int>(kMaxLag_s * 1000.0) + 2;  // frames at 1000 Hz
constexpr long kMaxWaiting = 8;  // most frames that wait until the period is known
constexpr double kEvenStep =
    1.5;  // periods: frames with a longer step between them are not neighbours

int rotation_channels(const Skeleton& skeleton) {
  return static_cast<int>(std::ranges::count_if(
      skeleton.channels, [](const Channel& channel) { return !channel.translation; }));
}

}  // namespace

struct LiveSmoother::State {
  State(const Skeleton& body, const LiveOptions& wanted)
      : skeleton(body),
        options(wanted),
        channels(rotation_channels(body)),
        unwrap(body),
        noise(channels),
        window(std::max(channels, 1)),
        measured(static_cast<std::size_t>(channels)),
        variance(hwy::AllocateAligned<double>(static_cast<std::size_t>(window.stride()))),
        values(body.channels.size()),
        pending(kMaxPending) {
    std::fill_n(variance.get(), window.stride(), kUnknown);
    for (std::size_t i = 0; i < body.channels.size(); ++i) {
      if (body.channels[i].translation) continue;
      angle_value.push_back(i);
      const int joint = body.channels[i].joint;
      if (turning.empty() || turning.back() != joint) turning.push_back(joint);
    }
  }

  [[nodiscard]] bool serves(const Frame& frame) const noexcept;
  void take(const Frame& frame) noexcept;
  void emit_until(long last, StageOut& out) noexcept;
  void rebuild(Frame& frame, int back) noexcept;
  void turn_joints(Frame& frame) noexcept;
  void name_gesture(Frame& frame, int back) const noexcept;
  void forget() noexcept;

  Skeleton skeleton;
  LiveOptions options;
  int channels;
  Unwrap unwrap;
  FrameClock clock;
  NoiseEstimate noise;
  AdaptiveWindow window;
  HmmForwardFilter filter{kMaxWindow};
  ModelPrior model_prior{filter};
  std::vector<double> measured;  // [channels] of the current frame
  hwy::AlignedFreeUniquePtr<double[]> variance;
  std::vector<std::size_t> angle_value;  // index of a rotation channel among all channels
  std::vector<int> turning;              // joints with rotation channels
  std::vector<double> values;            // [channels] of the emitted frame
  std::vector<Frame> pending;            // ring of the last frames
  long taken = 0;                        // number of frames received
  long emitted = 0;                      // number of frames emitted
  double last_s = 0.0;
};

LiveSmoother::LiveSmoother(const Skeleton& skeleton, const LiveOptions& options,
                           const LiveModel* model)
    : state_(std::make_unique<State>(skeleton, options)) {
  state_->filter.set_model(model);
}
LiveSmoother::~LiveSmoother() = default;

// RT-safe.
bool LiveSmoother::State::serves(const Frame& frame) const noexcept {
  return channels > 0 && frame.skeleton == skeleton.id && frame.angle_count == channels &&
         frame.joint_count == skeleton.joints.size();
}

// Stores the frame and extracts its channels, unwrapped. Channels that were not measured become NaN
// in both: all channels of a joint that is not valid, except those that the source does provide
// beside missing ones. RT-safe.
void LiveSmoother::State::take(const Frame& frame) noexcept {
  Frame& kept = pending[static_cast<std::size_t>(taken % kMaxPending)];
  kept = frame;
  ++taken;
  std::size_t first = 0;
  for (const int joint : turning) {
    std::size_t end = first;
    bool lacks = false;
    for (; end < angle_value.size() && skeleton.channels[angle_value[end]].joint == joint; ++end) {
      lacks = lacks || !std::isfinite(frame.angle_rad[end]);
    }
    const bool there = lacks || frame.valid[static_cast<std::size_t>(joint)];
    for (; first < end; ++first) {
      float& angle = kept.angle_rad[first];
      if (!there || !std::isfinite(angle)) angle = std::numeric_limits<float>::quiet_NaN();
      measured[first] = static_cast<double>(angle);
    }
  }
  unwrap.apply(measured);
}

// RT-safe.
void LiveSmoother::State::forget() noexcept {
  unwrap.reset();
  window.reset();
  filter.reset();
}

// RT-safe.
void LiveSmoother::process(const StageFrame& in, StageOut& out) noexcept {
  State& s = *state_;
  if (!s.serves(in.frame)) {
    flush(out);
    out.frame({.frame = in.frame});
    return;
  }
  const double now_s = s.clock.tick(in.frame.header);
  const double step_s = now_s - s.last_s;
  s.last_s = now_s;
  if (step_s > kForgetAfter_s) {
    flush(out);
    s.forget();
  }
  const double period_s = s.clock.period_s();
  if (s.taken - s.emitted >= window_frames(period_s)) flush(out);  // the beat became much slower
  s.take(in.frame);
  const bool even = step_s < kEvenStep * period_s;
  if (s.options.noise_rad <= 0.0) s.noise.push(s.measured, even);
  s.window.push(now_s, s.measured, noise_rad());
  if (s.filter.model() != nullptr) {
    s.filter.push(s.measured, even, period_s, noise_rad());
    s.filter.sweep(window_frames(period_s));
  }
  s.window.solve(period_s, s.filter.model() != nullptr ? &s.model_prior : nullptr);
  // Until the period is known, a lag in time cannot be converted into frames, so the first frames
  // wait.
  const bool in_time = s.options.lag.seconds > 0.0;
  if (in_time && !s.clock.settled() && s.taken - s.emitted < kMaxWaiting) return;
  s.emit_until(s.taken - 1 - lag_frames(s.options.lag, period_s), out);
}

// RT-safe.
void LiveSmoother::tick(std::int64_t /*now_ns*/, StageOut& out) noexcept { flush(out); }

// RT-safe.
void LiveSmoother::flush(StageOut& out) noexcept { state_->emit_until(state_->taken - 1, out); }

// RT-safe.
void LiveSmoother::reset() noexcept {
  State& s = *state_;
  s.forget();
  s.noise.reset();
  s.clock = FrameClock();
  s.emitted = s.taken = 0;
  s.last_s = 0.0;
}

// RT-safe.
const LiveModel* LiveSmoother::set_model(const LiveModel* model) noexcept {
  const LiveModel* const before = state_->filter.model();
  state_->filter.set_model(model);
  return before;
}

// RT-safe.
double LiveSmoother::noise_rad() const noexcept {
  const State& s = *state_;
  return s.options.noise_rad > 0.0 ? s.options.noise_rad : s.noise.noise_rad();
}

// Frames up to number `last` go out. RT-safe.
void LiveSmoother::State::emit_until(long last, StageOut& out) noexcept {
  for (; emitted <= last; ++emitted) {
    Frame frame = pending[static_cast<std::size_t>(emitted % kMaxPending)];
    rebuild(frame, static_cast<int>(taken - 1 - emitted));
    out.frame(
        {.frame = frame, .variance_rad2 = {variance.get(), static_cast<std::size_t>(channels)}});
  }
}

// Writes the solve's result into the frame `back` frames before the newest. RT-safe.
void LiveSmoother::State::rebuild(Frame& frame, int back) noexcept {
  window.variance(back, variance.get());
  const double* const x = window.x(back);
  frame.lag_frames = static_cast<std::uint16_t>(back);
  frame.lag_ms = static_cast<float>(1e3 * window.age_s(back));
  for (std::size_t c = 0; c < angle_value.size(); ++c) {
    float& angle = frame.angle_rad[c];
    if (!window.known(static_cast<int>(c))) {
      variance[c] = kUnknown;
      continue;
    }
    const bool there = std::isfinite(angle);
    if (!there) frame.quality = std::max(frame.quality, Quality::kPredicted);
    angle = static_cast<float>(there ? unwrap_near(x[c], static_cast<double>(angle)) : x[c]);
  }
  turn_joints(frame);
  if (filter.model() != nullptr) name_gesture(frame, back);
}

// RT-safe.
void LiveSmoother::State::name_gesture(Frame& frame, int back) const noexcept {
  const HmmForwardFilter::Answer answer = filter.label(back);
  frame.label.fill('\0');
  if (answer.label >= 0) {
    frame.label = filter.model()->labels[static_cast<std::size_t>(answer.label)];
  }
  frame.label_probability = static_cast<float>(answer.probability);
}

// Computes rotations from channels; a joint is valid when all its channels are known. RT-safe.
void LiveSmoother::State::turn_joints(Frame& frame) noexcept {
  for (std::size_t c = 0; c < angle_value.size(); ++c) {
    values[angle_value[c]] = static_cast<double>(frame.angle_rad[c]);
    const std::uint16_t joint = skeleton.channels[angle_value[c]].joint;
    if (c == 0 || joint != skeleton.channels[angle_value[c - 1]].joint) frame.valid[joint] = true;
    if (!window.known(static_cast<int>(c))) frame.valid[joint] = false;
  }
  for (const int joint : turning) {
    const auto j = static_cast<std::size_t>(joint);
    frame.rotation_xyzw[j] =
        frame.valid[j] ? from_eigen(local_rotation(skeleton, joint, values)) : kIdentity;
  }
}

}  // namespace posed::smooth
