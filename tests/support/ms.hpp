// A millisecond of posed's time (proto/frame/time.hpp).
#pragma once

#include <cstdint>

namespace posed::test {

inline constexpr std::int64_t kMs = 1'000'000;  // [ns]

}  // namespace posed::test
