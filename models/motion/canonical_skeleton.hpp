// The canonical humanoid with the proportions of a person (README.md, "Canonical humanoid").
#pragma once

#include <memory>

#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::motion {

// The bones that `skeleton` has, under their VRM names, where they are in its T-pose; every
// rotation of that pose is identity. Fails for a skeleton without hips. Cold.
[[nodiscard]] Result<std::shared_ptr<const Skeleton>> canonical_skeleton(const Skeleton& skeleton);

}  // namespace posed::motion
