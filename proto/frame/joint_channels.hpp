// The channels of one joint of a skeleton, and where they put it. RT-safe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "proto/frame/skeleton.hpp"

namespace posed {

// A part of Skeleton::channels, so the joint's values have the same place among those of a frame.
[[nodiscard]] inline std::span<const Channel> channels_of(const Skeleton& skeleton,
                                                          int joint) noexcept {
  const auto range = std::ranges::equal_range(
      skeleton.channels, joint, {}, [](const Channel& c) { return static_cast<int>(c.joint); });
  return {range.begin(), range.end()};
}

// Position of a joint in its parent's frame [m], from the values of its channels: position channels
// replace the joint's offset.
[[nodiscard]] inline Eigen::Vector3d local_position(const Joint& joint,
                                                    std::span<const Channel> channels,
                                                    const double* values) noexcept {
  Eigen::Vector3d position_m = joint.offset_m;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    if (channels[i].translation) position_m[static_cast<int>(channels[i].axis)] = values[i];
  }
  return position_m;
}

}  // namespace posed
