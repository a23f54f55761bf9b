#include "models/style/train/take_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "models/motion/motion.hpp"
#include "models/motion/pose_space.hpp"
#include "models/style/train/training_check.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/degree.hpp"
#include "proto/frame/rotation.hpp"
#include "proto/text/clean.hpp"

namespace posed::style {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kMaxSilence_s = 0.5;  // a stride has a second: what is missing cannot be guessed
constexpr double kMaxMissing = 0.1;    // share of the frames in which a joint may be missing
constexpr double kMaxStanding = 0.5;   // share of the take
constexpr double kSwingWindow_s = 1.5;
constexpr double kStands = 0.4;     // of the swing of a stride: below it the legs stand
constexpr double kStriding = 0.95;  // quantile of the swings that counts as that of a stride
constexpr double kMinSwing_rad = 6.0 * kDegree;

std::string number(double value, int digits) {
  std::string text =
      std::to_string(std::round(value * std::pow(10.0, digits)) / std::pow(10.0, digits));
  text.resize(text.find('.') + (digits > 0 ? static_cast<std::size_t>(digits) + 1 : 0));
  return text;
}

// The longest time without a frame.
double silence_s(const clip::Clip& clip) {
  double longest_s = 0.0;
  for (std::size_t i = 1; i < clip.time_s.size(); ++i) {
    longest_s = std::max(longest_s, clip.time_s[i] - clip.time_s[i - 1]);
  }
  return longest_s;
}

// Joints that lack values in some frames, in words; `problem` gets one that lacks too many to guess
// them. A joint that the device never measures stays still.
std::string missing_joints(const clip::Clip& clip, std::string& problem) {
  std::string words;
  const Skeleton& skeleton = *clip.skeleton;
  std::size_t last_joint = skeleton.joints.size();
  for (Eigen::Index c = 0; c < clip.channels.cols(); ++c) {
    const Channel& channel = skeleton.channels[static_cast<std::size_t>(c)];
    const auto missing =
        clip.channels.col(c).array().isFinite().select(0.0, VectorXd::Ones(clip.frames()).array());
    const double share = missing.mean();
    if (share == 0.0 || std::exchange(last_joint, channel.joint) == channel.joint) continue;
    const std::string joint = clean_name(skeleton.joints[channel.joint].name);
    const std::string percent = number(std::ceil(100.0 * share), 0) + " %";
    if (share > kMaxMissing && share < 1.0 && problem.empty()) {
      problem = joint;
      problem.append(" was missing in ").append(percent);
      problem.append(" of the frames: see to its sensor or marker, and walk again");
    }
    words.append(words.empty() ? "" : ", ").append(joint);
    if (share < 1.0) words.append(" (").append(percent).append(")");
  }
  return words;
}

// Share of the time in which the legs stand, where they stride at other times. The trainer leaves
// out standing by comparison with the take's median, so that it must not be the greater part.
double standing_share(const VectorXd& leg, double rate_hz) {
  const auto window = std::max<Eigen::Index>(2, std::lround(kSwingWindow_s * rate_hz));
  std::vector<double> swings;
  for (Eigen::Index t = 0; t + window <= leg.size(); ++t) {
    const auto part = leg.segment(t, window).array();
    swings.push_back(std::sqrt((part - part.mean()).square().mean()));
  }
  if (swings.empty()) return 0.0;
  std::vector<double> sorted = swings;
  std::ranges::sort(sorted);
  const double stride =
      sorted[static_cast<std::size_t>(kStriding * static_cast<double>(sorted.size() - 1))];
  if (stride < kMinSwing_rad) return 0.0;  // no legs that stride
  const auto stands = [&](double swing) { return swing < kStands * stride; };
  return static_cast<double>(std::ranges::count_if(swings, stands)) /
         static_cast<double>(swings.size());
}

// What the trainer keeps of the take.
void count_strides(const AlignedClip& clip, double rate_hz, TakeCheck& check) {
  const auto kept = static_cast<double>(clip.q.rows());
  check.strides = static_cast<int>(kept * clip.dtheta / (2.0 * std::numbers::pi));
  constexpr double kEnds_s = 2.0 / 3.0;  // that it leaves out of every recording
  check.standing_s = std::max(0.0, check.seconds - kept / rate_hz - kEnds_s);
}

// The legs' side of the check.
void check_walk(const TrainingClip& take, double rate_hz, TakeCheck& check) {
  const auto motion = motion::motion_of(take.clip);
  if (!motion) {
    check.problem = motion.error().message;
    return;
  }
  const auto leg = motion::leg_signal(*motion);
  if (!leg) {
    check.problem =
        "the skeleton names no thighs, so no strides can be heard: a style is taught with a body";
    return;
  }
  if (const double share = standing_share(*leg, take.clip.frame_rate_hz); share > kMaxStanding) {
    check.problem = "the legs stood for " + number(share * check.seconds, 0) + " of " +
                    number(check.seconds, 0) + " s: keep walking, and walk again";
    return;
  }
  DatasetOptions options;
  options.space = usual_space({take});
  options.rate_hz = rate_hz;
  const auto dataset = make_dataset({take}, {}, options);
  if (!dataset) {
    check.problem = dataset.error().message;
    return;
  }
  const AlignedClip& clip = dataset->clips.front();
  if (const std::string why = no_strides(clip); !why.empty()) {
    check.problem = "this is no walk, because " + why + ": walk, and keep walking";
    return;
  }
  count_strides(clip, rate_hz, check);
  if (check.strides >= kMinTakeStrides) return;
  check.problem = "only " + std::to_string(check.strides) +
                  (check.strides == 1 ? " stride was heard" : " strides were heard") + " in " +
                  number(check.seconds, 1) + " s, and " + std::to_string(kMinTakeStrides) +
                  " are needed: walk longer";
}

constexpr double kStraight_rad = 30.0 * kDegree;
constexpr double kHalfWindow_s = 1.25;  // longer than a stride, whose sway stays

// The value at each place of a line through its neighbours, under Hann weights: without what swings
// faster than the window, and without lag, also at the ends.
std::vector<double> smooth(const std::vector<double>& values, std::ptrdiff_t half) {
  std::vector<double> smoothed(values.size());
  const auto size = std::ssize(values);
  for (std::ptrdiff_t i = 0; i < size; ++i) {
    double w = 0.0, wx = 0.0, wxx = 0.0, wy = 0.0, wxy = 0.0;
    for (std::ptrdiff_t k = std::max(-i, -half); k <= std::min(size - 1 - i, half); ++k) {
      const double x = static_cast<double>(k) / static_cast<double>(half + 1);
      const double weight = 0.5 + 0.5 * std::cos(std::numbers::pi * x);
      const double y = values[static_cast<std::size_t>(i + k)];
      w += weight;
      wx += weight * x;
      wxx += weight * x * x;
      wy += weight * y;
      wxy += weight * x * y;
    }
    const double spread = w * wxx - wx * wx;
    smoothed[static_cast<std::size_t>(i)] =
        spread > 1e-9 * w * w ? (wxx * wy - wx * wxy) / spread : wy / w;
  }
  return smoothed;
}

// How far the body has turned by each frame [rad], without jumps of a whole turn.
std::vector<double> turned_rad(const clip::Clip& clip, const motion::PoseSpace& space) {
  std::vector<double> heading_rad(static_cast<std::size_t>(clip.frames()));
  for (std::size_t i = 0; i < heading_rad.size(); ++i) {
    const double measured_rad = space.heading_rad(clip.frame(static_cast<int>(i)));
    heading_rad[i] = i == 0 ? measured_rad : unwrap_near(measured_rad, heading_rad[i - 1]);
  }
  std::vector<double> turned = smooth(heading_rad, std::lround(kHalfWindow_s * clip.frame_rate_hz));
  const double first_rad = turned.front();
  for (double& turn : turned) turn -= first_rad;
  return turned;
}

Vector3d root_m(const Frame& frame) {
  return Eigen::Map<const Eigen::Vector3f>(frame.root_position_m.data()).cast<double>();
}

// Turns a walk that goes about a stage into one that goes straight on: training sees a clip from
// one heading, and who walks for 20 s in a room must turn. Cold. Takes out of all frames how far
// the body has turned since the first one, by the pelvis without the sway of its strides. A clip
// that keeps its heading within 30 degrees, or whose skeleton has none, stays as it is. All values
// must be finite.
void straighten(clip::Clip& clip) {
  const bool is_person = motion::is_person(*clip.skeleton);
  const auto spec = motion::describe_space(
      is_person ? motion::Space::kHumanoid : motion::Space::kNative, *clip.skeleton);
  if (!spec || clip.frames() < 2) return;
  const auto space = motion::PoseSpace::bind(*spec, *clip.skeleton);
  if (!space) return;
  const std::vector<double> turned = turned_rad(clip, *space);
  const auto [least, most] = std::ranges::minmax(turned);
  if (most - least < kStraight_rad) return;
  clip::FramesClip straight(clip.skeleton);
  Vector3d before_m = root_m(clip.frame(0));
  Vector3d at_m = before_m;
  for (std::size_t i = 0; i < turned.size(); ++i) {
    Frame frame = clip.frame(static_cast<int>(i));
    frame.angle_count = 0;  // the rotations count
    const Quaterniond back = axis_rotation(Axis::kY, -turned[i]);
    const Vector3d now_m = root_m(frame);
    at_m += back * (now_m - std::exchange(before_m, now_m));
    Eigen::Map<Eigen::Vector3f>(frame.root_position_m.data()) = at_m.cast<float>();
    for (std::size_t j = 0; j < clip.skeleton->joints.size(); ++j) {
      if (clip.skeleton->joints[j].parent >= 0) continue;
      frame.rotation_xyzw[j] = from_eigen(back * to_eigen_double(frame.rotation_xyzw[j]));
    }
    straight.add(frame);
  }
  auto made = straight.finish(clip.path, clip.frame_rate_hz, clip.time_s);
  if (made && made->channels.cols() == clip.channels.cols()) {
    clip.channels = std::move(made->channels);
  }
}

}  // namespace

std::string TakeCheck::sentence() const {
  if (!good()) return problem;
  std::string text = std::to_string(strides) + " strides in " + number(seconds, 1) + " s";
  constexpr double kWorthSaying_s = 0.5;
  if (standing_s >= kWorthSaying_s) {
    text += "; " + number(standing_s, 1) + " s of standing are left out";
  }
  if (!incomplete.empty()) text += "; missing: " + incomplete;
  return text;
}

TakeCheck check_take(TrainingClip& take, double rate_hz) {
  TakeCheck check;
  clip::Clip& clip = take.clip;
  if (clip.frames() < 2 || clip.time_s.back() <= clip.time_s.front()) {
    check.problem = "no frames came: see whether the device streams, and walk again";
    return check;
  }
  check.seconds = clip.time_s.back() - clip.time_s.front();
  clip.frame_rate_hz = (clip.frames() - 1) / check.seconds;
  if (const double gap_s = silence_s(clip); gap_s > kMaxSilence_s) {
    check.problem = "the device was silent for " + number(gap_s, 1) +
                    " s: see to its connection, and walk again";
    return check;
  }
  check.incomplete = missing_joints(clip, check.problem);
  if (!check.good()) return check;
  clip::hold_missing(clip);
  straighten(clip);
  check_walk(take, rate_hz, check);
  return check;
}

}  // namespace posed::style
