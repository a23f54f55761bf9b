// Which canonical bone a joint is, by the names that mocap programs and figures use: CMU (BVH and
// ASF), Mixamo, Axis Neuron, VRM / Unity, and the many that spell them alike.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "proto/frame/humanoid.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed {

// Sets Joint::bone where a joint's name says it. A bone is given once, to the joint nearest the
// root; the trunk between hips and neck is shared out by how many joints it has. Cold.
void name_bones(Skeleton& skeleton);

}  // namespace posed
