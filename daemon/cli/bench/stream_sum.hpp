// The yardstick of `posed bench predict`: reading floats as fast as this CPU can.
#pragma once

namespace posed::cli {

// The sum of data[0 .. count), count a multiple of 128, on the best instruction set there is: eight
// vector accumulators, so that nothing but the bytes costs time.
[[nodiscard]] float stream_sum(const float* data, int count);

}  // namespace posed::cli
