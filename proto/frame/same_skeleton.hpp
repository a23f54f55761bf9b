// Tells whether two skeletons are interchangeable. Cold.
#pragma once

#include "proto/frame/skeleton.hpp"

namespace posed {

// Null stands for "no skeleton". The id is only a checksum, and engines have room for so many
// joints and channels, so the counts must be equal, too: descriptions are untrusted.
[[nodiscard]] inline bool same_skeleton(const Skeleton* a, const Skeleton* b) noexcept {
  if (a == nullptr || b == nullptr) return a == b;
  return a->id == b->id && a->joints.size() == b->joints.size() &&
         a->channels.size() == b->channels.size();
}

}  // namespace posed
