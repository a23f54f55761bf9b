// The bodies of the template mocap system, compiled from its description.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/template_mocap/protocol.hpp"

namespace posed::drivers::mocap {

class MocapLayout final : public SourceLayout {
 public:
  std::vector<std::uint16_t> id;  // [body], as the device numbers them

  // The index of a body; bodies.size() when there is no such body. RT-safe.
  [[nodiscard]] std::size_t body_of(std::uint16_t wanted) const noexcept;
};

// The skeleton of a body as it was described. Cold.
[[nodiscard]] Result<std::shared_ptr<const Skeleton>> skeleton_of(const BodyEntry& body);

// Driver::make_layout. Cold.
[[nodiscard]] Result<std::unique_ptr<const SourceLayout>> make_layout(
    std::span<const std::byte> description);

}  // namespace posed::drivers::mocap
