// The avatars of an Axis stream as bodies, compiled from the decoder's own description.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "drivers/axis/description.hpp"
#include "drivers/driver.hpp"

namespace posed::drivers::axis {

class AxisLayout final : public SourceLayout {
 public:
  struct Known {
    Avatar avatar;
    bool reference = false;
  };
  std::vector<Known> known;  // [body]

  // The index of a body; bodies.size() when there is no such body. RT-safe.
  [[nodiscard]] std::size_t body_of(const Avatar& avatar) const noexcept;
};

// The skeleton of an avatar, "Reference" above the hips if the stream has it. The joints have the
// stream's rotation channels; reference and hips also have positions. Cold.
[[nodiscard]] Result<std::shared_ptr<const Skeleton>> skeleton_of(const AvatarEntry& entry,
                                                                  std::uint8_t order);

// Driver::make_layout. Cold.
[[nodiscard]] Result<std::unique_ptr<const SourceLayout>> make_layout(
    std::span<const std::byte> description);

}  // namespace posed::drivers::axis
