// Fails the test if a hot thread has broken the real-time contract since forget_breaches().
#pragma once

#include <catch2/catch.hpp>

#include "tests/rt/contract.hpp"

namespace posed::rt {

inline void check_no_breach() {
  for (int b = 0; b < static_cast<int>(Breach::kCount); ++b) {
    INFO(kBreachNames[static_cast<std::size_t>(b)] << ", last system call " << last_system_call());
    CHECK(breaches(static_cast<Breach>(b)) == 0);
  }
}

}  // namespace posed::rt
