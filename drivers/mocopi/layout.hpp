// The one body of a mocopi app, compiled from the skeleton that it sends.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/mocopi/protocol.hpp"

namespace posed::drivers::mocopi {

class MocopiLayout final : public SourceLayout {
 public:
  std::vector<std::uint16_t> id;  // [joint], depth first

  // The joint of a bone; id.size() when there is none. RT-safe.
  [[nodiscard]] std::size_t joint_of(std::uint16_t bone) const noexcept;
};

// Driver::make_layout. Cold.
[[nodiscard]] Result<std::unique_ptr<const SourceLayout>> make_layout(
    std::span<const std::byte> description);

}  // namespace posed::drivers::mocopi
