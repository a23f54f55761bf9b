// The bodies of a Studio stream, compiled from the decoder's description.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/rokoko/description.hpp"

namespace posed::drivers::rokoko {

// Where the joints of a skeleton come from.
struct BodyPlan {
  BodyKey key;
  std::vector<std::uint8_t> joint;  // [joint of the skeleton] joint of joints.hpp
  bool face = false;
};

class StudioLayout final : public SourceLayout {
 public:
  std::vector<BodyPlan> plans;  // [body]

  // The index of a body; bodies.size() when there is no such body. RT-safe.
  [[nodiscard]] std::size_t body_of(const BodyKey& key) const noexcept;
};

// The skeleton of a body as it was described; null for one with only a face. Cold.
[[nodiscard]] Result<std::shared_ptr<const Skeleton>> skeleton_of(const DescribedBody& body,
                                                                  const std::string& name);

// Driver::make_layout. Cold.
[[nodiscard]] Result<std::unique_ptr<const SourceLayout>> make_layout(
    std::span<const std::byte> description);

}  // namespace posed::drivers::rokoko
