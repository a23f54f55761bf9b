#include "models/gesture/pose_channels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "proto/frame/hand_skeleton.hpp"
#include "proto/text/clean.hpp"

namespace posed::gesture {
namespace {

constexpr double kNoTurn_rad = 1e-6;  // so small a rotation vector has no direction

// The squared distance of two rotation vectors.
double distance2(const double* a, const double* b) noexcept {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

// The same rotation the other way round, where that is nearer.
RT_SAFE void turn_near(const double* last, double* value) noexcept {
  const double angle_rad = std::hypot(value[0], value[1], value[2]);
  if (!(angle_rad > kNoTurn_rad)) return;  // also where it is not finite
  const double other = 1.0 - 2.0 * std::numbers::pi / angle_rad;
  const std::array<double, 3> round{value[0] * other, value[1] * other, value[2] * other};
  if (distance2(round.data(), last) < distance2(value, last)) std::ranges::copy(round, value);
}

}  // namespace

int most_channels(const Skeleton& skeleton) {
  if (hand_side(skeleton)) return kHandChannels;
  const auto is_bone = [](const Joint& joint) { return joint.bone.has_value(); };
  return 3 * std::max(1, static_cast<int>(std::ranges::count_if(skeleton.joints, is_bone)));
}

PoseChannels PoseChannels::of_hand(const Skeleton& skeleton) {
  PoseChannels channels;
  channels.count_ = kHandChannels;
  channels.skeleton_ = std::make_shared<const Skeleton>(skeleton);
  return channels;
}

Result<PoseChannels> PoseChannels::bind(const Vocabulary& vocabulary, const Skeleton& skeleton) {
  const bool is_hand = hand_side(skeleton).has_value();
  if (vocabulary.is_hand() && !is_hand) {
    return fail("the model is of hands, but " + in_quotes(skeleton.name) +
                " is none: give it to a stream of a hand");
  }
  if (!vocabulary.is_hand() && is_hand) {
    return fail("the model is of a body, but " + in_quotes(skeleton.name) +
                " is a hand: give it to a stream of a body");
  }
  if (is_hand) return of_hand(skeleton);
  auto space = TRY(motion::PoseSpace::bind(*vocabulary.body, skeleton));
  PoseChannels channels;
  channels.count_ = space.dims();
  if (channels.count_ > most_channels(skeleton)) {
    return fail("the model has a joint twice; train it again");
  }
  channels.skeleton_ = std::make_shared<const Skeleton>(skeleton);
  for (const Channel& channel : skeleton.channels) {
    if (channel.translation) continue;
    int first = 0;
    while (first < channels.count_ && space.skeleton_joint_of_dim(first) != channel.joint) {
      first += 3;
    }
    channels.first_of_.push_back(first < channels.count_ ? first : -1);
  }
  channels.space_ = std::move(space);
  return channels;
}

RT_SAFE int PoseChannels::joint_of(int channel) const noexcept {
  return space_ ? space_->skeleton_joint_of_dim(channel) : 1 + channel / 3;
}

RT_SAFE void PoseChannels::read(const Frame& frame, double heading_rad,
                                std::span<double> values) const noexcept {
  if (!space_) {
    std::ranges::copy(hand_angles(frame), values.begin());
    return;
  }
  const std::size_t dims = count_;
  std::array<float, motion::kMaxPoseDims> q;
  std::array<std::uint8_t, motion::kMaxPoseDims> available;
  space_->to_vector(frame, heading_rad, {q.data(), dims}, {available.data(), dims});
  for (std::size_t d = 0; d < dims; ++d) {
    const bool there = available[d] != 0 && std::isfinite(q[d]);
    values[d] = there ? static_cast<double>(q[d]) : std::numeric_limits<double>::quiet_NaN();
  }
}

RT_SAFE void PoseChannels::unwrap(std::span<const double> last,
                                  std::span<double> values) const noexcept {
  if (!space_) return;
  for (std::size_t d = 0; d + 3 <= values.size(); d += 3) turn_near(&last[d], &values[d]);
}

RT_SAFE void PoseChannels::write(std::span<const double> values, double heading_rad,
                                 Frame& frame) const noexcept {
  if (space_) return space_->put(frame, heading_rad, values);
  HandAngles angles;
  std::copy_n(values.begin(), angles.size(), angles.begin());
  const Vec3f root_position_m = frame.root_position_m;
  set_hand_angles(*skeleton_, angles, frame);
  frame.root_position_m = root_position_m;
}

RT_SAFE void PoseChannels::spread(std::span<const double> variance,
                                  std::span<double> of_frame) const noexcept {
  if (!space_) {
    for (std::size_t c = 0; c < of_frame.size(); ++c) of_frame[c] = variance[kAngleOfChannel[c]];
    return;
  }
  for (std::size_t c = 0; c < of_frame.size(); ++c) {
    if (first_of_[c] < 0) continue;
    const std::size_t d = first_of_[c];
    of_frame[c] = (variance[d] + variance[d + 1] + variance[d + 2]) / 3.0;
  }
}

}  // namespace posed::gesture
