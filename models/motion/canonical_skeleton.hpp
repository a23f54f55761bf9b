// The canonical humanoid with the proportions of a person (models/motion/README.md, "Canonical
// humanoid").
#pragma once

#include <memory>

#include "proto/frame/humanoid.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::motion {

// The bones that `skeleton` has from `root` downwards, under their VRM names, where they are in its
// T-pose; every rotation of that pose is identity. `root` is the hips of a person, or the wrist of
// a single hand. Fails for a skeleton without it. Cold.
Result<std::shared_ptr<const Skeleton>> canonical_skeleton(const Skeleton& skeleton,
                                                           Bone root = Bone::kHips);

// The same bones where they are in the zero pose, in which every rotation is identity, with their T
// frames and the place of `root` in that pose. Cold.
Result<std::shared_ptr<const Skeleton>> resting_skeleton(const Skeleton& skeleton,
                                                         Bone root = Bone::kHips);

}  // namespace posed::motion
