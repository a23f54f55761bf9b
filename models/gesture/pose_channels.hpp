// PoseChannels: where the channels of a vocabulary are in the frames of one skeleton. Those of a
// hand are the angles of its joints, in the order of hand45; those of a body are the rotation
// vectors of its joints in the canonical humanoid, seen from a heading (models/motion/README.md,
// "Pose spaces"). The performance of a model and its recognition see a frame through it alone.
//
// Values in radians. Built cold, then const and shareable; all else is RT-safe.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "models/gesture/vocabulary.hpp"
#include "models/motion/pose_space.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::gesture {

// The most channels that a vocabulary can have on this skeleton: what to allocate for models that
// are exchanged. Cold.
[[nodiscard]] int most_channels(const Skeleton& skeleton);

class PoseChannels {
 public:
  // Errors: a hand's vocabulary on a skeleton that is no hand, a body's on a hand or on a skeleton
  // that lacks joints of it. Cold.
  static Result<PoseChannels> bind(const Vocabulary& vocabulary, const Skeleton& skeleton);
  // The channels of a hand, which need no vocabulary. `skeleton` is a hand. Cold.
  [[nodiscard]] static PoseChannels of_hand(const Skeleton& skeleton);

  [[nodiscard]] int count() const noexcept { return count_; }
  [[nodiscard]] bool is_hand() const noexcept { return !space_; }

  // For a body: where the pelvis points, and whether the frame measured that.
  [[nodiscard]] bool has_heading(const Frame& frame) const noexcept {
    return space_ && space_->has_heading(frame);
  }
  [[nodiscard]] double heading_rad(const Frame& frame) const noexcept {
    return space_->heading_rad(frame);
  }

  // The frame's values [count()]; NaN where it did not measure them. A hand has no heading.
  void read(const Frame& frame, double heading_rad, std::span<double> values) const noexcept;
  // Turns each joint's rotation vector the way round that is nearer to `last`; a hand's angles stay
  // as they are. Both [count()].
  void unwrap(std::span<const double> last, std::span<double> values) const noexcept;
  // Poses the frame; joints that are no channels, joints with values that are not finite, the
  // root's place and all but the pose stay. A hand has no joints but its channels.
  void write(std::span<const double> values, double heading_rad, Frame& frame) const noexcept;

  // Variances [count()] as a frame's: [rotation channel], where a channel of a body has the mean of
  // its joint's three. Those of joints that are no channels stay.
  void spread(std::span<const double> variance, std::span<double> of_frame) const noexcept;

  // Whether a rotation channel of the frame belongs to a joint of a body that is a channel here.
  [[nodiscard]] bool covers(std::size_t rotation_channel) const noexcept {
    return space_ && first_of_[rotation_channel] >= 0;
  }
  // The skeleton's joint of a channel.
  [[nodiscard]] int joint_of(int channel) const noexcept;

 private:
  PoseChannels() = default;

  int count_ = 0;
  std::shared_ptr<const Skeleton> skeleton_;
  std::optional<motion::PoseSpace> space_;  // empty: a hand
  std::vector<int> first_of_;  // [rotation channel] first channel of its joint; -1: it has none
};

}  // namespace posed::gesture
