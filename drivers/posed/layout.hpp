// The one body of an upstream's stream, compiled from its skeleton message.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "drivers/driver.hpp"

namespace posed::drivers::chain {

class UpstreamLayout final : public SourceLayout {
 public:
  // Skeleton::id at the upstream. It differs from that of the skeleton made here, because a message
  // carries less (proto/message/skeleton_message.hpp).
  std::uint32_t upstream_id = 0;
};

// Driver::make_layout. Cold.
[[nodiscard]] Result<std::unique_ptr<const SourceLayout>> make_layout(
    std::span<const std::byte> description);

}  // namespace posed::drivers::chain
