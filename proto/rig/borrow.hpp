// A person who lacks an arm or a leg, with the other side's in its place. Cold.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "proto/rig/bones.hpp"
#include "proto/rig/recognise.hpp"

namespace posed::rig {

struct WholePerson {
  RigInput input;  // the figure's joints, then those that are borrowed
  std::vector<JointName> names;
  std::vector<std::string> notes;  // sentences
};

// The mirror images of limbs that `bones`, found by names, has on one side only. Both legs or both
// arms say what is left and right. Empty when that is not enough for a person.
[[nodiscard]] std::optional<WholePerson> with_borrowed_limbs(const RigInput& input,
                                                             const Figure& figure,
                                                             const std::vector<JointName>& names,
                                                             BoneJoints bones);

}  // namespace posed::rig
