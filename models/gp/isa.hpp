// Which instruction set the predictor's kernels run on. Highway picks the best that the CPU has;
// the choice can be forced, because replay promises bits for one instruction set. avx2 and avx512
// give the same bits; portable (no fused multiply-add) differs in the last ones.
#pragma once

#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::gp {

// "portable", "avx2", "avx512" or "auto". For the whole process: call it before any predictor runs
// on another thread. Refuses what this CPU lacks.
[[nodiscard]] Result<> set_isa(std::string_view name);

// What the kernels run on now: "portable", "avx2" or "avx512".
[[nodiscard]] std::string_view isa_name();

}  // namespace posed::gp
