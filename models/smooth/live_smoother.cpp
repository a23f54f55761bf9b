#include "models/smooth/live_smoother.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "models/gesture/pose_channels.hpp"
#include "models/motion/heading.hpp"
#include "models/smooth/adaptive_window.hpp"
#include "models/smooth/model_prior.hpp"
#include "models/smooth/motion_models.hpp"
#include "models/smooth/noise_estimate.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/frame/median.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::smooth {
namespace {

constexpr double kMinPeriod_s = 1e-3;  // 1000 Hz
constexpr double kMaxPeriod_s = 0.2;   // a slower step is a gap
constexpr double kFirstPeriod_s = 1.0 / 60.0;
constexpr double kMinStep = 0.5;      // of the period
constexpr double kArrivalGain = 0.1;  // share of the lateness that corrects a step
constexpr double kGap = 1.5;          // periods: a step at least this long is a gap, not jitter

constexpr double kPi = std::numbers::pi;

double distance_rad(const std::array<double, 3>& a, const double* b) noexcept {
  return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
}

std::array<double, 3> nearest(std::array<double, 3> angles, const double* last) noexcept {
  for (std::size_t i = 0; i < 3; ++i) angles[i] = unwrap_near(angles[i], last[i]);
  return angles;
}

RT_SAFE void unwrap_joint(double* values, const double* last) noexcept {
  const auto same = nearest({values[0], values[1], values[2]}, last);
  const auto other = nearest({values[0] + kPi, kPi - values[1], values[2] + kPi}, last);
  std::ranges::copy(distance_rad(other, last) < distance_rad(same, last) ? other : same, values);
}

bool all_finite(const double* values) noexcept {
  return std::isfinite(values[0]) && std::isfinite(values[1]) && std::isfinite(values[2]);
}

constexpr double kUnknown = std::numeric_limits<double>::infinity();  // variance
constexpr double kForgetAfter_s = 1.0;  // after a longer silence the past is forgotten
constexpr int kMaxPending = static_cast<int>(kMaxLag_s * 1000.0) + 2;  // frames at 1000 Hz
constexpr long kMaxWaiting = 8;  // most frames that wait until the period is known
constexpr double kEvenStep =
    1.5;  // periods: frames with a longer step between them are not neighbours
constexpr double kHeadingStep_s = 0.1;  // the heading takes a longer step between frames for this

int rotation_channels(const Skeleton& skeleton) {
  return static_cast<int>(std::ranges::count_if(
      skeleton.channels, [](const Channel& channel) { return !channel.translation; }));
}

// The most columns of the window: a gesture model of a body has three for each joint that is a
// bone, in place of the joint's own channels.
int most_columns(const Skeleton& skeleton, int angles) {
  if (hand_side(skeleton)) return angles;
  const auto is_free = [&skeleton](const Channel& channel) {
    return !channel.translation && !skeleton.joints[channel.joint].bone;
  };
  return std::max(angles, gesture::most_channels(skeleton) +
                              static_cast<int>(std::ranges::count_if(skeleton.channels, is_free)));
}

}  // namespace

// FrameClock: computes times that a solver can use from the times that frames carry
// (models/smooth/README.md, "Frame clock"). Device times are used as they are; arrival times of an
// even stream come in bursts and are drawn towards the stream's own period. Steps are never shorter
// than half the period, so that two frames which arrive together do not look infinitely fast, and a
// time that runs backwards counts as one period. One thread.
class FrameClock {
 public:
  // Seconds since the first frame; strictly increasing.
  RT_SAFE double tick(const Header& header) noexcept;

  // The stream's period: the median of the last steps [s]; 0 before the first step.
  RT_SAFE [[nodiscard]] double period_s() const noexcept { return period_s_; }
  // True when enough steps are known to convert a lag in time into frames.
  RT_SAFE [[nodiscard]] bool settled() const noexcept { return steps_ >= kSettled; }

 private:
  void learn(double step_s) noexcept;

  static constexpr int kRecent = 15;
  static constexpr int kSettled = 3;

  std::array<double, kRecent> recent_s_{};
  int steps_ = 0;  // number of steps learned so far
  double period_s_ = 0.0;
  double now_s_ = 0.0;
  double late_s_ = 0.0;  // accumulated lateness of arrivals relative to even frames
  std::int64_t last_ns_ = kNoTime_ns;
  bool started_ = false;
  bool device_time_ = false;
};

RT_SAFE double FrameClock::tick(const Header& header) noexcept {
  const bool device_time = header.device_ns != kNoTime_ns;
  const std::int64_t time_ns = device_time ? header.device_ns : header.arrival_ns;
  const bool first = !std::exchange(started_, true);
  const bool known = time_ns != kNoTime_ns && last_ns_ != kNoTime_ns &&
                     device_time == device_time_ && time_ns > last_ns_;
  const double beat_s = period_s_ > 0.0 ? period_s_ : kFirstPeriod_s;
  double step_s = beat_s;
  if (known) {
    // Unsigned: the difference of two times may exceed the signed range.
    step_s = static_cast<double>(static_cast<std::uint64_t>(time_ns) -
                                 static_cast<std::uint64_t>(last_ns_)) *
             1e-9;
    learn(step_s);
  }
  last_ns_ = time_ns;
  device_time_ = device_time;
  if (first) return now_s_;
  if (!device_time && settled()) {
    late_s_ += step_s - beat_s;
    if (late_s_ > (kGap - 1.0) * beat_s) {
      step_s = beat_s + late_s_;
      late_s_ = 0.0;
    } else {
      step_s = beat_s + kArrivalGain * late_s_;
      late_s_ -= kArrivalGain * late_s_;
    }
  }
  now_s_ += std::max(step_s, kMinStep * beat_s);
  return now_s_;
}

RT_SAFE void FrameClock::learn(double step_s) noexcept {
  if (step_s > kMaxPeriod_s) return;
  recent_s_[steps_ % kRecent] = std::max(step_s, kMinPeriod_s);
  ++steps_;
  std::array<double, kRecent> sorted = recent_s_;
  period_s_ = median(std::span(sorted).first(std::min(steps_, kRecent)));
}

// Unwrap: removes jumps from a skeleton's rotation channels (models/smooth/README.md, "Unwrap").
// Each channel takes the multiple of a full turn that is nearest to its previous value. Three Euler
// angles describe a rotation in two ways, (x, y, z) and (x + pi, pi - y, z + pi); the one nearer to
// the previous frame is used. A joint with limits, as of a hand, is left alone: its angles have one
// way only, and a source that errs may jump by more than half a turn. One thread.
class Unwrap {
 public:
  explicit Unwrap(const Skeleton& skeleton);

  // values_rad: [rotation channels], changed in place; NaN where missing, and left NaN.
  RT_SAFE void apply(std::span<double> values_rad) noexcept;

  RT_SAFE void reset() noexcept;

 private:
  struct Joint {
    int channels = 0;
    bool limited = true;  // all of them
  };
  std::vector<Joint> joints_;     // that have any, in channel order
  std::vector<double> last_rad_;  // [rotation channels]; NaN before the first value
};

Unwrap::Unwrap(const Skeleton& skeleton) {
  int joint = -1;
  for (const Channel& channel : skeleton.channels) {
    if (channel.translation) continue;
    if (channel.joint != joint) joints_.emplace_back();
    joint = channel.joint;
    ++joints_.back().channels;
    if (!(channel.max - channel.min < 2.0 * kPi)) joints_.back().limited = false;
    last_rad_.push_back(0.0);
  }
  reset();
}

RT_SAFE void Unwrap::reset() noexcept {
  std::ranges::fill(last_rad_, std::numeric_limits<double>::quiet_NaN());
}

RT_SAFE void Unwrap::apply(std::span<double> values_rad) noexcept {
  double* values = values_rad.data();
  double* last = last_rad_.data();
  for (const auto& [count, limited] : joints_) {
    if (limited) {
      // as it is
    } else if (count == 3 && all_finite(values) && all_finite(last)) {
      unwrap_joint(values, last);
    } else {
      for (int i = 0; i < count; ++i) {
        if (!std::isnan(last[i])) values[i] = unwrap_near(values[i], last[i]);
      }
    }
    for (int i = 0; i < count; ++i) {
      if (std::isfinite(values[i])) last[i] = values[i];
    }
    values += count;
    last += count;
  }
}

// The window solves for columns: first the channels of a body's gesture model, then the free
// angles, which are the rotation channels of joints that this model lacks; without such a model
// they are all. Columns that are left over are a constant 0.
struct LiveSmoother::State {
  State(const Skeleton& figure, const LiveOptions& wanted)
      : skeleton(figure),
        options(wanted),
        angles(rotation_channels(figure)),
        columns(std::max(most_columns(figure, angles), 1)),
        unwrap(figure),
        noise(columns),
        window(columns),
        motions(columns),
        filter(kMaxWindow, gesture::most_channels(figure), wanted.error_rad),
        model_prior(filter, gesture::most_channels(figure)),
        measured(static_cast<std::size_t>(columns)),
        angle(static_cast<std::size_t>(angles)),
        posed(measured.size()),
        posed_now(measured.size()),
        column_variance(hwy::AllocateAligned<double>(static_cast<std::size_t>(window.stride()))),
        solved(measured.size()),
        variance(static_cast<std::size_t>(angles), kUnknown),
        values(figure.channels.size()),
        pending(kMaxPending),
        heading_rad(kMaxPending) {
    free_angle.resize(angles);
    for (std::size_t i = 0; i < figure.channels.size(); ++i) {
      if (figure.channels[i].translation) continue;
      angle_value.push_back(i);
      const int joint = figure.channels[i].joint;
      if (turning.empty() || turning.back() != joint) turning.push_back(joint);
    }
    lay_out(nullptr);
  }

  [[nodiscard]] bool serves(const Frame& frame) const noexcept;
  void lay_out(const LiveModel* model) noexcept;
  void receive(const Frame& frame, double step_s) noexcept;
  void receive_body(const Frame& frame, double step_s) noexcept;
  void sense(double now_s, double step_s, double period_s) noexcept;
  void solve(double period_s) noexcept;
  void emit_until(long last, StageOut& out) noexcept;
  void rebuild(Frame& frame, int back) noexcept;
  void turn_joints(Frame& frame) noexcept;
  void pose_body(Frame& frame, double toward_rad, const double* x) noexcept;
  void use(const LiveModel* model) noexcept;
  void name_gesture(Frame& frame, int back) const noexcept;
  void forget() noexcept;

  Skeleton skeleton;
  LiveOptions options;
  int angles;
  int columns;
  Unwrap unwrap;
  FrameClock clock;
  NoiseEstimate noise;
  AdaptiveWindow window;
  MotionModels motions;
  HmmForwardFilter filter;
  ModelPrior model_prior;
  std::vector<double> measured;   // [columns] of the current frame
  std::vector<double> angle;      // [angles] of the current frame
  std::vector<double> posed;      // [columns] a body's channels, each as it was measured last
  std::vector<double> posed_now;  // the same as it is shown
  trajectory::Rows column_variance;
  std::vector<double> solved;                   // [columns] of the emitted frame
  std::vector<double> variance;                 // [angles] of the emitted frame
  const gesture::PoseChannels* body = nullptr;  // of the model in use; null: none of a body
  std::size_t body_columns = 0;
  std::vector<std::size_t> free_angle;  // angles that are not of the body's channels
  std::size_t free_angles = 0;          // how many
  motion::LiveHeading heading;
  std::vector<std::size_t> angle_value;  // index of a rotation channel among all channels
  std::vector<int> turning;              // joints with rotation channels
  std::vector<double> values;            // [channels] of the emitted frame
  std::vector<Frame> pending;            // ring of the last frames
  std::vector<double> heading_rad;       // of these
  long ready = 0;                        // frames below this number wait, but are solved already
  long received = 0;                     // number of frames received
  long emitted = 0;                      // number of frames emitted
  double last_s = 0.0;
};

LiveSmoother::LiveSmoother(const Skeleton& skeleton, const LiveOptions& options,
                           const LiveModel* model)
    : state_(std::make_unique<State>(skeleton, options)) {
  state_->use(model);
}
LiveSmoother::~LiveSmoother() = default;

RT_SAFE void LiveSmoother::State::lay_out(const LiveModel* model) noexcept {
  body = model != nullptr && model->body ? &*model->body : nullptr;
  body_columns = body != nullptr ? static_cast<std::size_t>(body->count()) : 0;
  free_angles = 0;
  for (std::size_t c = 0; c < free_angle.size(); ++c) {
    if (body == nullptr || !body->covers(c)) free_angle[free_angles++] = c;
  }
  std::ranges::fill(measured, 0.0);
  std::ranges::fill(posed, 0.0);
}

// What waits is solved for a last time before the columns change.
RT_SAFE void LiveSmoother::State::use(const LiveModel* model) noexcept {
  const bool changes = body != nullptr || (model != nullptr && model->body);
  if (changes) {
    for (long i = std::max(emitted, ready); i < received; ++i) {
      rebuild(pending[i % kMaxPending], static_cast<int>(received - 1 - i));
    }
    ready = received;
    forget();
    noise.reset();
    lay_out(model);
  }
  filter.set_model(model);
}

RT_SAFE bool LiveSmoother::State::serves(const Frame& frame) const noexcept {
  return body_columns + free_angles > 0 && frame.skeleton == skeleton.id &&
         frame.angle_count == angles && frame.joint_count == skeleton.joints.size();
}

// Stores the frame in `pending` and its unwrapped channels in `angle`. What was not measured
// becomes NaN in both: every channel that is not finite, and all of a joint that is not valid
// although none of its channels is missing.
RT_SAFE void LiveSmoother::State::receive(const Frame& frame, double step_s) noexcept {
  Frame& kept = pending[received % kMaxPending];
  kept = frame;
  ++received;
  std::size_t first = 0;
  for (const int joint : turning) {
    std::size_t end = first;
    bool lacks = false;
    for (; end < angle_value.size() && skeleton.channels[angle_value[end]].joint == joint; ++end) {
      lacks = lacks || !std::isfinite(frame.angle_rad[end]);
    }
    const bool there = lacks || frame.valid[joint];
    for (; first < end; ++first) {
      float& value = kept.angle_rad[first];
      if (!there || !std::isfinite(value)) value = std::numeric_limits<float>::quiet_NaN();
      angle[first] = static_cast<double>(value);
    }
  }
  unwrap.apply(angle);
  for (std::size_t i = 0; i < free_angles; ++i) measured[body_columns + i] = angle[free_angle[i]];
  if (body != nullptr) receive_body(frame, step_s);
}

// The columns of a body's model, as the frame stored last has them.
RT_SAFE void LiveSmoother::State::receive_body(const Frame& frame, double step_s) noexcept {
  if (body->has_heading(frame)) {
    const double dt_s = std::min(step_s, kHeadingStep_s);
    static_cast<void>(heading.update(body->heading_rad(frame), dt_s));
  }
  heading_rad[(received - 1) % kMaxPending] = heading.value_rad();
  const std::span<double> values_rad = std::span(measured).first(body_columns);
  body->read(frame, heading.value_rad(), values_rad);
  body->unwrap(std::span(posed).first(body_columns), values_rad);
  for (std::size_t c = 0; c < body_columns; ++c) {
    if (std::isfinite(measured[c])) posed[c] = measured[c];
  }
}

RT_SAFE void LiveSmoother::State::forget() noexcept {
  unwrap.reset();
  window.reset();
  motions.reset();
  filter.reset();
  heading = motion::LiveHeading();
}

// Passes the frame's values on to whatever learns from them. With a stated noise the window alone
// smooths.
RT_SAFE void LiveSmoother::State::sense(double now_s, double step_s, double period_s) noexcept {
  const bool even = step_s < kEvenStep * period_s;
  const double stated_rad = options.noise_rad;
  if (stated_rad > 0.0) {
    window.push(now_s, measured, {.noise_rad = stated_rad});
  } else {
    noise.push(measured, even, period_s);
    motions.push(step_s, measured, noise.noise_rad(), noise.share());
    window.push(now_s, measured,
                {.noise_rad = noise.noise_rad(),
                 .jitter_rad = noise.jitter_rad(),
                 .share = noise.share(),
                 .rounding_rad = noise.rounding_rad(),
                 .half_step_rad = noise.half_step_rad(),
                 .repeated = noise.repeated(),
                 .again = noise.again()});
  }
  const double noise_rad = stated_rad > 0.0 ? stated_rad : noise.noise_rad();
  if (filter.model() == nullptr) return;
  filter.push(std::span(measured).first(filter.model()->channels), even, period_s, noise_rad);
  filter.sweep(window_frames(period_s));
}

RT_SAFE void LiveSmoother::State::solve(double period_s) noexcept {
  window.solve(period_s, filter.model() != nullptr ? &model_prior : nullptr);
  if (options.noise_rad > 0.0 || window.frames() < 2) return;
  window.variance(1, column_variance.get());
  motions.judge(window.x(1), column_variance.get());
}

RT_SAFE void LiveSmoother::process(const StageFrame& in, StageOut& out) noexcept {
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
  if (s.received - s.emitted >= window_frames(period_s)) flush(out);  // the beat became much slower
  s.receive(in.frame, step_s);
  s.sense(now_s, step_s, period_s);
  s.solve(period_s);
  // Until the period is known, a lag in time cannot be converted into frames, so the first frames
  // wait.
  const bool in_time = s.options.lag.seconds > 0.0;
  if (in_time && !s.clock.settled() && s.received - s.emitted < kMaxWaiting) return;
  s.emit_until(s.received - 1 - lag_frames(s.options.lag, period_s), out);
}

RT_SAFE void LiveSmoother::tick(std::int64_t /*now_ns*/, StageOut& out) noexcept { flush(out); }

RT_SAFE void LiveSmoother::flush(StageOut& out) noexcept {
  state_->emit_until(state_->received - 1, out);
}

RT_SAFE void LiveSmoother::reset() noexcept {
  State& s = *state_;
  s.forget();
  s.noise.reset();
  s.clock = FrameClock();
  s.emitted = s.received = s.ready = 0;
  s.last_s = 0.0;
}

RT_SAFE const LiveModel* LiveSmoother::set_model(const LiveModel* model) noexcept {
  const LiveModel* const before = state_->filter.model();
  state_->use(model);
  return before;
}

RT_SAFE double LiveSmoother::noise_rad() const noexcept {
  const State& s = *state_;
  return s.options.noise_rad > 0.0 ? s.options.noise_rad : s.noise.noise_rad();
}

// Frames up to number `last` go out.
RT_SAFE void LiveSmoother::State::emit_until(long last, StageOut& out) noexcept {
  for (; emitted <= last; ++emitted) {
    Frame frame = pending[emitted % kMaxPending];
    if (emitted >= ready) {
      rebuild(frame, static_cast<int>(received - 1 - emitted));
    } else {
      std::ranges::fill(variance, kUnknown);
    }
    out.frame({.frame = frame, .variance_rad2 = variance});
  }
}

// Writes the solve's result into the frame `back` frames before the newest.
RT_SAFE void LiveSmoother::State::rebuild(Frame& frame, int back) noexcept {
  window.variance(back, column_variance.get());
  std::copy_n(window.x(back), columns, solved.begin());
  // The evidence of the motion models holds for white noise only.
  if (noise.white() && back <= kMaxLagFrames) {
    for (int c = 0; c < columns; ++c) solved[c] = motions.mixed(c, back, solved[c]);
  }
  const double* const x = solved.data();
  frame.lag_frames = static_cast<std::uint16_t>(back);
  frame.lag_ms = static_cast<float>(1e3 * window.age_s(back));
  for (std::size_t i = 0; i < free_angles; ++i) {
    const std::size_t column = body_columns + i;
    const std::size_t c = free_angle[i];
    float& value = frame.angle_rad[c];
    variance[c] = column_variance[column];
    if (!window.known(static_cast<int>(column))) {
      variance[c] = kUnknown;
      continue;
    }
    const bool there = std::isfinite(value);
    if (!there) frame.quality = std::max(frame.quality, Quality::kPredicted);
    if (there) {
      // A value that is only rounded is nowhere farther from the truth than half a step.
      const double shown_rad = static_cast<double>(value);
      const double half_rad = noise.half_step_rad()[column];
      value = static_cast<float>(std::clamp(unwrap_near(x[column], shown_rad), shown_rad - half_rad,
                                            shown_rad + half_rad));
    } else {
      value = static_cast<float>(x[column]);
    }
  }
  turn_joints(frame);
  if (body != nullptr) {
    const long number = received - 1 - back;
    pose_body(frame, heading_rad[number % kMaxPending], x);
  }
  if (filter.model() != nullptr) name_gesture(frame, back);
}

RT_SAFE void LiveSmoother::State::name_gesture(Frame& frame, int back) const noexcept {
  const HmmForwardFilter::Answer answer = filter.label(back);
  frame.label.fill('\0');
  if (answer.label >= 0) {
    frame.label = filter.model()->labels[answer.label];
  } else if (answer.label == HmmForwardFilter::kNone) {
    std::ranges::copy(kNoneName, frame.label.begin());
  }
  frame.label_probability = static_cast<float>(answer.probability);
}

// Computes rotations from the free angles; a joint is valid when all its channels are known.
RT_SAFE void LiveSmoother::State::turn_joints(Frame& frame) noexcept {
  for (std::size_t i = 0; i < free_angles; ++i) {
    const std::size_t c = free_angle[i];
    values[angle_value[c]] = static_cast<double>(frame.angle_rad[c]);
    const std::uint16_t joint = skeleton.channels[angle_value[c]].joint;
    if (c == 0 || joint != skeleton.channels[angle_value[c - 1]].joint) frame.valid[joint] = true;
    if (!window.known(static_cast<int>(body_columns + i))) frame.valid[joint] = false;
  }
  std::size_t first = 0;  // angle of the joint
  for (const int joint : turning) {
    const bool covered = body != nullptr && body->covers(first);
    while (first < angle_value.size() && skeleton.channels[angle_value[first]].joint == joint) {
      ++first;
    }
    if (covered) continue;
    const std::size_t j = joint;
    frame.rotation_xyzw[j] =
        frame.valid[j] ? from_eigen(local_rotation(skeleton, joint, values)) : kIdentity;
  }
}

// Poses the joints of a body's model; one that no frame of the window measured stays as it is.
RT_SAFE void LiveSmoother::State::pose_body(Frame& frame, double toward_rad,
                                            const double* x) noexcept {
  for (std::size_t c = 0; c < body_columns; ++c) {
    const bool known = window.known(static_cast<int>(c));
    posed_now[c] = known ? x[c] : std::numeric_limits<double>::quiet_NaN();
    if (!known) column_variance[c] = kUnknown;
    const auto joint = static_cast<std::size_t>(body->joint_of(static_cast<int>(c)));
    if (known && !frame.valid[joint]) frame.quality = std::max(frame.quality, Quality::kPredicted);
  }
  body->write(std::span(posed_now).first(body_columns), toward_rad, frame);
  body->spread({column_variance.get(), body_columns}, variance);
}

}  // namespace posed::smooth
