// What must hold in a fuzz target: if not, the process ends and libFuzzer keeps the input.
#pragma once

#include <cstdlib>

namespace posed::fuzz {

inline void demand(bool holds) {
  if (!holds) std::abort();
}

}  // namespace posed::fuzz
