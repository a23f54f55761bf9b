// Builds the datagrams of the mocopi app, for the emulator and for outputs, and the bones of an
// average person. Cold: allocates.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/mocopi/protocol.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::drivers::mocopi {

[[nodiscard]] std::vector<std::byte> encode_skeleton(std::span<const BoneEntry> bones);
// `time_s` counts from any origin.
[[nodiscard]] std::vector<std::byte> encode_frame(std::uint32_t number, double time_s,
                                                  double unix_s, std::span<const BoneEntry> bones);

// The bones of an average person in T-pose, by their numbers, all lengths times `scale`; and the
// skeleton that posed makes of them.
[[nodiscard]] std::vector<BoneEntry> average_bones(float scale);
Result<std::shared_ptr<const Skeleton>> average_skeleton(float scale);

}  // namespace posed::drivers::mocopi
