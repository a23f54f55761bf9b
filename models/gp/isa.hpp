// Choice of the instruction set that the predictor's kernels run on. Highway picks the best that
// the CPU has; the choice can be forced, because a replay is bit-exact on one instruction set only.
// avx2 and avx512 give the same bits; portable (no fused multiply-add) differs in the last bits.
#pragma once

#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::gp {

// "portable", "avx2", "avx512" or "auto". Applies to the whole process: call it before any
// predictor runs on another thread. Returns an error for an instruction set that this CPU lacks.
Result<> set_isa(std::string_view name);

// The instruction set in use: "portable", "avx2" or "avx512".
[[nodiscard]] std::string_view isa_name();

}  // namespace posed::gp
