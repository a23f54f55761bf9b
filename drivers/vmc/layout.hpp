// The performer, compiled from the description that the decoder writes.
#pragma once

#include <array>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "drivers/driver.hpp"
#include "drivers/vmc/protocol.hpp"

namespace posed::drivers::vmc {

class VmcLayout final : public SourceLayout {
 public:
  static constexpr int kNone = -1;

  // The index of the first sample value of this blend shape or device; kNone if it has none.
  RT_SAFE [[nodiscard]] int place_of(ValueKind kind, std::string_view name) const noexcept;

  // Null if nothing or only values are sent.
  [[nodiscard]] const Skeleton* skeleton() const noexcept {
    return bodies.empty() ? nullptr : bodies.front().skeleton.get();
  }

  std::array<int, kBoneCount> joint_of{};  // [bone]; kNone for one that has no joint
  bool hips_sent = false;                  // they have a joint also when they are not sent
  struct Value {
    ValueKind kind{};
    std::string name;  // as it is sent
    int place = 0;
  };
  std::vector<Value> values;
  std::size_t value_count = 0;  // of a sample
};

// Driver::make_layout. Cold.
Result<std::unique_ptr<SourceLayout>> make_layout(std::span<const std::byte> description);

}  // namespace posed::drivers::vmc
