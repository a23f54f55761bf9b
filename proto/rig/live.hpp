// The recogniser asked about a skeleton without a clip. Cold.
#pragma once

#include "proto/frame/skeleton.hpp"
#include "proto/rig/recognise.hpp"

namespace posed::rig {

[[nodiscard]] Rig recognise(const Skeleton& skeleton);

}  // namespace posed::rig
