// The row that the device log keeps when the bodies of a source change (Direction::kDescription):
// u16 number of bodies, for each u32 id of its stream (0xffffffff: it has none), both
// little-endian; then the description as the device sent it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace posed::pipeline {

struct DescriptionRow {
  std::vector<std::uint32_t> streams;      // [body]
  std::span<const std::byte> description;  // part of the row
};

[[nodiscard]] std::vector<std::byte> pack_description(std::span<const std::uint32_t> streams,
                                                      std::span<const std::byte> description);
// Empty if the row is cut, or names more bodies than a source can have.
[[nodiscard]] std::optional<DescriptionRow> unpack_description(std::span<const std::byte> row);

}  // namespace posed::pipeline
