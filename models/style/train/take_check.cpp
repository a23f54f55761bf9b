#include "models/style/train/take_check.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "models/feet/foot_score.hpp"
#include "models/motion/motion.hpp"
#include "models/style/train/training_check.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/text/clean.hpp"

namespace posed::style {
namespace {

using Eigen::VectorXd;

constexpr double kMaxSilence_s = 0.5;  // a stride has a second: what is missing cannot be guessed
constexpr double kMaxMissing = 0.1;    // share of the frames in which a joint may be missing
// Nobody runs faster, and below this length it is the noise of a fast device.
constexpr double kMaxSpeed_mps = 12.0, kMinJump_m = 0.3;

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

// How far the body jumps where a tracking system loses it [m]; 0: nowhere.
double jump_m(const clip::Clip& clip) {
  const auto root_m = [&](int i) { return Eigen::Vector3f(clip.frame(i).root_position_m.data()); };
  double longest_m = 0.0;
  Eigen::Vector3f before = root_m(0);
  for (int i = 1; i < clip.frames(); ++i) {
    const Eigen::Vector3f now = root_m(i);
    const double length_m = static_cast<double>((now - before).norm());
    const auto at = static_cast<std::size_t>(i);
    const double time_s = clip.time_s[at] - clip.time_s[at - 1];
    if (length_m > kMinJump_m && length_m > kMaxSpeed_mps * time_s) {
      longest_m = std::max(longest_m, length_m);
    }
    before = now;
  }
  return longest_m;
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

// What the trainer keeps of the take.
void count_strides(const AlignedClip& clip, double rate_hz, TakeCheck& check) {
  const auto kept = static_cast<double>(clip.q.rows());
  check.strides = static_cast<int>(kept * clip.dtheta / (2.0 * std::numbers::pi));
  constexpr double kEnds_s = 2.0 / 3.0;  // that it leaves out of every recording
  check.standing_s = std::max(0.0, check.seconds - kept / rate_hz - kEnds_s);
}

// What a take says of its feet: a foot that hangs teaches a limp, and a place or a floor that is
// wrong teaches a wrong pace and height.
void check_feet(const motion::Motion& motion, TakeCheck& check) {
  // Who limps moves his worse foot two thirds as far as the other, and on a narrow turn the inner
  // one moves as little.
  constexpr double kMinSwing = 0.4;
  // A walker's slower foot has .3 m/s at most; a runner's both fly, at half his speed. On a
  // treadmill the body stays.
  constexpr double kSlides_m_s = 0.4, kSlides = 0.6, kGoes_m_s = 0.2;
  constexpr double kUneven_m = 0.1;
  const auto feet = feet::foot_capture(motion);
  if (!feet) return;
  for (std::size_t leg = 0; leg < feet::kLegs; ++leg) {
    if (feet->swing_m[leg] >= kMinSwing * feet->swing_m[1 - leg]) continue;
    check.problem = std::string("the ") + (leg == 0 ? "left" : "right") +
                    " foot hardly moved beside the other: see to its sensor or marker, and walk"
                    " again";
    return;
  }
  constexpr double kStride_s = 1.0;
  const double speed_m_s = feet::root_speed_m_s(motion, kStride_s);
  if (speed_m_s > kGoes_m_s && feet->slower_m_s > std::max(kSlides_m_s, kSlides * speed_m_s)) {
    check.feet = "standing feet slide at " + number(100.0 * feet->slower_m_s, 0) +
                 " cm/s, because the body goes faster or slower than they step";
  }
  if (feet->uneven_m > kUneven_m) {
    check.feet += check.feet.empty() ? "" : "; ";
    check.feet += "the floor under the feet differs by " + number(100.0 * feet->uneven_m, 0) +
                  " cm: see to the height of the capture";
  }
}

// The legs' side of the check.
void check_walk(const TrainingClip& take, double rate_hz, TakeCheck& check) {
  const auto motion = motion::motion_of(take.clip);
  if (!motion) {
    check.problem = motion.error().message;
    return;
  }
  if (!motion::leg_signal(*motion)) {
    check.problem =
        "the skeleton names no thighs, so no strides can be heard: a style is taught with a body";
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
  if (check.strides >= kMinTakeStrides) {
    check_feet(motion::resample(*motion, rate_hz), check);
    return;
  }
  check.problem = "only " + std::to_string(check.strides) +
                  (check.strides == 1 ? " stride was heard" : " strides were heard") + " in " +
                  number(check.seconds, 1) + " s, and " + std::to_string(kMinTakeStrides) +
                  " are needed: walk longer";
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
  if (!feet.empty()) text += "; " + feet;
  return text;
}

TakeCheck check_take(TrainingClip& take, double rate_hz, double silent_s) {
  TakeCheck check;
  clip::Clip& clip = take.clip;
  if (clip.frames() < 2 || clip.time_s.back() <= clip.time_s.front()) {
    check.problem = "no frames came: see whether the device streams, and walk again";
    return check;
  }
  check.seconds = clip.time_s.back() - clip.time_s.front();
  clip.frame_rate_hz = (clip.frames() - 1) / check.seconds;
  if (const double gap_s = std::max(silent_s, silence_s(clip)); gap_s > kMaxSilence_s) {
    check.problem = "the device was silent for " + number(gap_s, 1) +
                    " s: see to its connection, and walk again";
    return check;
  }
  check.incomplete = missing_joints(clip, check.problem);
  if (!check.good()) return check;
  clip::hold_missing(clip);
  if (const double far_m = jump_m(clip); far_m > 0.0) {
    check.problem = "the body jumped by " + number(far_m, 1) +
                    " m from one frame to the next: see to its tracking, and walk again";
    return check;
  }
  check_walk(take, rate_hz, check);
  return check;
}

}  // namespace posed::style
