// The hands of gloves on the body of another stream (models/merge/README.md). The stage holds each
// frame of the body until every glove that is there has measured up to its time, at most `wait_s`,
// and gives it the hand poses of that time.
#pragma once

#include <cstddef>

#include "models/stage_type.hpp"

namespace posed::merge {

// Frames of the body that wait at once; one more releases the oldest with what is known of the
// hands so far.
inline constexpr std::size_t kMaxWaiting = 8;

// The entry in the list of stages (models/stages/registry.cpp).
[[nodiscard]] const StageType& merge_type();

}  // namespace posed::merge
