// The default of stale_after_s, here because neither config nor pipeline includes the other.
#pragma once

namespace posed::system {

inline constexpr double kStaleAfter_s = 0.5;  // after this long without data a stream is stale

}  // namespace posed::system
