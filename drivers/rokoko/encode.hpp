// Pieces of the JSON that Rokoko Studio sends, for the emulator and for outputs, and an average
// person. Cold: allocates.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/rokoko/description.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::drivers::rokoko {

// Appends "position":{...},"rotation":{...}, given in posed's axes.
void append_transform(std::string& json, const Vec3f& position_m, const Quatf& rotation_xyzw);
// Appends the joints of an actor, "hip":{...},"spine":{...}: the global pose from the frame's. A
// joint that is not valid is sent as all zero.
void append_joints(std::string& json, const Skeleton& skeleton, const Frame& frame);

// The JSON as an LZ4 frame.
[[nodiscard]] std::vector<std::byte> compress(std::string_view json);

// A person of 1.75 m times `scale` in T-pose with these joints: what Studio would stream and the
// decoder would describe.
[[nodiscard]] DescribedBody average_person(std::string_view name, const JointSet& joints,
                                           float scale);
// All joints but those of the fingers.
[[nodiscard]] JointSet without_fingers();

}  // namespace posed::drivers::rokoko
