#include "proto/clip/frames_clip.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/frame/median.hpp"
#include "proto/frame/rotation.hpp"

namespace posed::clip {
namespace {

constexpr double kAddedPoseJump = 4.0;       // times the largest step that follows
constexpr double kAddedPoseJump_rad = 0.09;  // and at least 5 degrees rms over the joints

// Rotation between two frames [rad], rms over the joints below the root.
double step_rad(const Frame& a, const Frame& b, int root) {
  double squares = 0.0;
  for (int j = root + 1; j < a.joint_count; ++j) {
    const double angle_rad =
        angle_between_rad(to_eigen_double(a.rotation_xyzw[j]), to_eigen_double(b.rotation_xyzw[j]));
    squares += angle_rad * angle_rad;
  }
  return std::sqrt(squares / std::max(1, a.joint_count - root - 1));
}

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

// The skeleton of a device that gives rotations alone has no channels: here its root moves, and all
// joints turn.
std::shared_ptr<const Skeleton> with_moving_root(const Skeleton& skeleton) {
  auto moving = std::make_shared<Skeleton>(skeleton);
  for (const Axis axis : {Axis::kX, Axis::kY, Axis::kZ}) {
    moving->channels.push_back({.joint = static_cast<std::uint16_t>(moving->root_joint),
                                .axis = axis,
                                .translation = true});
  }
  const auto finished = moving->finish();  // updates the id
  assert(finished);                        // these joints have passed before
  (void)finished;
  return moving;
}

std::shared_ptr<const Skeleton> writable(std::shared_ptr<const Skeleton> skeleton) {
  if (skeleton->channels.empty()) {
    skeleton = with_moving_root(*skeleton);
  } else if (!is_acclaim(*skeleton)) {
    return skeleton;
  }
  Clip none;
  none.skeleton = std::move(skeleton);
  none.channels.resize(0, std::ssize(none.skeleton->channels));
  return with_zyx_channels(none).skeleton;
}

int moving_joint(const Skeleton& skeleton) {
  for (int j = skeleton.root_joint; j >= 0; j = skeleton.joints[j].parent) {
    for (const Channel& channel : skeleton.channels) {
      if (channel.translation && channel.joint == j) return j;
    }
  }
  return -1;
}

Eigen::Quaterniond rotation_of(const Frame& frame, int joint) {
  return to_eigen_double(frame.rotation_xyzw[joint]);
}

double median_step_s(const std::vector<double>& time_s) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time_s.size(); ++i) steps.push_back(time_s[i] - time_s[i - 1]);
  return median(steps);
}

// The nominal rate, which may be a guess of the stage's: a device at another pace keeps its own.
double kept_rate_hz(double nominal_hz, double step_s) {
  constexpr double kOther = 0.2;
  if (nominal_hz <= 0.0) return 1.0 / step_s;
  const bool other = step_s > 0.0 && std::abs(step_s * nominal_hz - 1.0) > kOther;
  return other ? std::max(std::round(1.0 / step_s), 1.0) : nominal_hz;
}

}  // namespace

FramesClip::FramesClip(const std::shared_ptr<const Skeleton>& skeleton)
    : skeleton_(writable(skeleton)),
      exact_(skeleton_ == skeleton),
      moving_(moving_joint(*skeleton_)),
      row_(skeleton_->channels.size()) {
  for (std::size_t c = 0; c < row_.size(); ++c) {
    const Channel& channel = skeleton_->channels[c];
    if (channel.translation) {
      row_[c] = skeleton_->joints[channel.joint].offset_m[static_cast<int>(channel.axis)];
    }
  }
}

void FramesClip::add(const Frame& frame, const Timecode& timecode) {
  add_angles(frame);
  add_root_position(frame);
  values_.insert(values_.end(), row_.begin(), row_.end());
  timecode_.push_back(timecode);
}

void FramesClip::halve() {
  if (!row_.empty()) drop_every_second(values_, row_.size());
  drop_every_second(timecode_);
}

void FramesClip::add_angles(const Frame& frame) {
  std::size_t angle = 0;
  for (std::size_t c = 0; c < row_.size();) {
    if (skeleton_->channels[c].translation) {
      ++c;
      continue;
    }
    const int joint = skeleton_->channels[c].joint;
    const std::size_t first = c;
    while (c < row_.size() && skeleton_->channels[c].joint == joint &&
           !skeleton_->channels[c].translation) {
      ++c;
    }
    const std::span<double> angles(row_.data() + first, c - first);
    if (exact_ && frame.angle_count > 0) {
      for (double& value : angles) value = static_cast<double>(frame.angle_rad[angle++]);
      continue;
    }
    std::array<double, 3> near_rad{};
    std::ranges::transform(angles, near_rad.begin(),
                           [](double value) { return std::isfinite(value) ? value : 0.0; });
    const auto turned =
        channels_from_rotation(*skeleton_, joint, rotation_of(frame, joint), near_rad);
    const bool known = frame.valid[joint];
    for (std::size_t i = 0; i < angles.size(); ++i) angles[i] = known ? turned[i] : kNoValue;
  }
}

// A frame holds the position of the root joint in the world. This computes the position of the
// moving joint in its parent's frame from it, through the bones between them.
void FramesClip::add_root_position(const Frame& frame) {
  if (moving_ < 0) return;
  std::vector<int> chain;  // from the moving joint's parent towards the root
  for (int j = skeleton_->joints[moving_].parent; j >= 0; j = skeleton_->joints[j].parent) {
    chain.push_back(j);
  }
  Eigen::Quaterniond above = Eigen::Quaterniond::Identity();  // parent's frame to world
  Eigen::Vector3d parent = Eigen::Vector3d::Zero();
  for (auto j = chain.rbegin(); j != chain.rend(); ++j) {
    parent += above * skeleton_->joints[*j].offset_m;
    above = above * rotation_of(frame, *j);
  }
  Eigen::Vector3d below = Eigen::Vector3d::Zero();  // root joint in the moving joint's frame
  for (int j = skeleton_->root_joint; j != moving_; j = skeleton_->joints[j].parent) {
    below = skeleton_->joints[j].offset_m + rotation_of(frame, j) * below;
  }
  const Eigen::Vector3d root =
      Eigen::Map<const Eigen::Vector3f>(frame.root_position_m.data()).cast<double>();
  const Eigen::Vector3d position =
      above.conjugate() * (root - parent) - rotation_of(frame, moving_) * below;
  for (std::size_t c = 0; c < row_.size(); ++c) {
    const Channel& channel = skeleton_->channels[c];
    if (channel.translation && channel.joint == moving_) {
      row_[c] = position[static_cast<int>(channel.axis)];
    }
  }
}

Result<Clip> FramesClip::finish(const std::string& path, double rate_hz,
                                std::vector<double> time_s) const {
  if (time_s.size() < 2) return fail("has fewer than two frames of this stream", path);
  Clip clip;
  clip.path = path;
  clip.skeleton = skeleton_;
  clip.frame_rate_hz = kept_rate_hz(rate_hz, median_step_s(time_s));
  clip.channels =
      Eigen::Map<const ChannelMatrix>(values_.data(), std::ssize(time_s), std::ssize(row_));
  clip.time_s = std::move(time_s);
  if (std::ranges::any_of(timecode_, [](const Timecode& code) { return code != Timecode{}; })) {
    clip.timecode = timecode_;
  }
  return clip;
}

void FrameTimes::halve() {
  drop_every_second(arrival_ns_);
  drop_every_second(device_ns_);
}

std::vector<double> FrameTimes::in_seconds() const {
  const bool running = std::ranges::find(device_ns_, kNoTime_ns) == device_ns_.end() &&
                       std::ranges::is_sorted(device_ns_, std::ranges::less_equal());
  const std::vector<std::int64_t>& times_ns = running ? device_ns_ : arrival_ns_;
  std::vector<double> times_s;
  times_s.reserve(times_ns.size());
  for (const std::int64_t time_ns : times_ns) {
    times_s.push_back(seconds(time_ns - times_ns.front()));
  }
  return times_s;
}

bool begins_with_added_pose(int frames, int root_joint,
                            const std::function<const Frame&(int)>& frame) {
  if (frames < 3) return false;
  const double first = step_rad(frame(0), frame(1), root_joint);
  if (!(first > kAddedPoseJump_rad)) return false;
  double largest = 0.0;
  const Frame* before = &frame(1);
  for (int t = 2; t < frames; ++t) {
    const Frame& now = frame(t);
    largest = std::max(largest, step_rad(*before, now, root_joint));
    before = &now;
  }
  return first > kAddedPoseJump * largest;
}

bool begins_with_added_pose(const Clip& clip) {
  std::array<Frame, 2> two;
  return begins_with_added_pose(clip.frames(), clip.skeleton->root_joint,
                                [&](int t) -> const Frame& { return two[t % 2] = clip.frame(t); });
}

void hold_missing(Clip& clip) {
  std::size_t held = 0;
  for (Eigen::Index c = 0; c < clip.channels.cols(); ++c) {
    auto column = clip.channels.col(c);
    double last = 0.0;
    for (Eigen::Index i = column.size() - 1; i >= 0; --i) {
      if (std::isfinite(column[i])) last = column[i];  // the first finite value
    }
    for (double& value : column) {
      if (std::isfinite(value)) {
        last = value;
        continue;
      }
      value = last;
      ++held;
    }
  }
  if (held == 0) return;
  clip.warnings.push_back(std::to_string(held) + " of " + std::to_string(clip.channels.size()) +
                          " values are missing; each holds the one before it");
}

namespace {

// How many frames are missing before each frame of a clip. A frame that is late, and frames that
// come in bursts, are followed or preceded by early ones, and are not taken for missing.
std::vector<std::size_t> missing_before(const std::vector<double>& time_s, double step_s) {
  constexpr double kForgets = 0.9;       // of each frame, since a device's clock may drift
  constexpr std::size_t kCatchesUp = 4;  // frames within which a late device does
  const auto late_by = [&](std::size_t i) { return (time_s[i] - time_s[i - 1]) / step_s - 1.0; };
  std::vector<std::size_t> missing(time_s.size());
  double late = 0.0;  // steps
  for (std::size_t i = 1; i < time_s.size(); ++i) {
    late = kForgets * late + late_by(i);
    if (late_by(i) < 0.5) continue;
    double lacks = late;
    double still = 0.0;
    for (std::size_t k = i; k < std::min(i + 1 + kCatchesUp, time_s.size()); ++k) {
      still += late_by(k);
      lacks = std::min(lacks, still);
    }
    lacks = std::max(0.0, std::round(lacks));
    missing[i] = static_cast<std::size_t>(lacks);
    late -= lacks;
  }
  return missing;
}

// Those that are held: not in the longest gaps, and in all no more than there are frames, or than a
// minute has, because whoever sends says the times.
std::vector<std::size_t> held_of(const Clip& clip, const std::vector<std::size_t>& missing) {
  std::size_t room =
      std::max(missing.size(), static_cast<std::size_t>(kMaxHeld_s * clip.frame_rate_hz));
  std::vector<std::size_t> held = missing;
  for (std::size_t i = 1; i < held.size(); ++i) {
    const bool cut = clip.time_s[i] - clip.time_s[i - 1] > kMaxHeld_s || held[i] > room;
    if (cut) held[i] = 0;
    room -= held[i];
  }
  return held;
}

std::string gap_words(const Clip& clip, const std::vector<std::size_t>& missing,
                      const std::vector<std::size_t>& held) {
  constexpr std::size_t kMaxNamed = 5;
  std::string where;
  std::size_t gaps = 0, frames = 0;
  for (std::size_t i = 0; i < missing.size(); ++i) {
    if (missing[i] == 0) continue;
    frames += missing[i];
    if (++gaps > kMaxNamed) continue;
    where += fmt::format("{}{} at {:.2f} s", gaps > 1 ? ", " : "", missing[i], clip.time_s[i - 1]);
    if (held[i] == 0) where += " (cut out)";
  }
  if (gaps > kMaxNamed) where += fmt::format(" and {} more gaps", gaps - kMaxNamed);
  return fmt::format("{} frames are missing: {}; the one before each gap is held", frames, where);
}

}  // namespace

void hold_gaps(Clip& clip) {
  if (clip.frames() < 2) return;
  const auto missing = missing_before(clip.time_s, 1.0 / clip.frame_rate_hz);
  if (std::ranges::all_of(missing, [](std::size_t frames) { return frames == 0; })) return;
  const auto held = held_of(clip, missing);
  clip.warnings.push_back(gap_words(clip, missing, held));
  std::vector<std::size_t> from;  // the frame that each one of the new clip is
  std::vector<double> time_s;
  for (std::size_t i = 0; i < missing.size(); ++i) {
    for (std::size_t k = 1; k <= held[i]; ++k) {
      from.push_back(i - 1);
      const double share = static_cast<double>(k) / static_cast<double>(held[i] + 1);
      time_s.push_back(std::lerp(clip.time_s[i - 1], clip.time_s[i], share));
    }
    from.push_back(i);
    time_s.push_back(clip.time_s[i]);
  }
  clip.channels = ChannelMatrix(clip.channels(from, Eigen::all));
  clip.time_s = std::move(time_s);
  if (clip.timecode.empty()) return;
  std::vector<Timecode> timecode;
  timecode.reserve(from.size());
  for (const std::size_t i : from) timecode.push_back(clip.timecode[i]);
  clip.timecode = std::move(timecode);
}

}  // namespace posed::clip
