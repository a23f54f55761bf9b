// Finds each joint's canonical bone by its name, as mocap programs and figures spell it: CMU (BVH
// and ASF), Mixamo, Axis Neuron, VRM / Unity, and many similar ones.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "proto/frame/humanoid.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed {

// Sets Joint::bone where a joint's name identifies it. Each bone goes to one joint, the one nearest
// the root. The trunk between hips and neck is divided by its number of joints. Cold.
void name_bones(Skeleton& skeleton);

}  // namespace posed
