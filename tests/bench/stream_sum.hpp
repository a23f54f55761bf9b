// The reference of `posed_bench predict`: reading floats as fast as this CPU can.
#pragma once

namespace posed::bench {

// The sum of data[0 .. count), count a multiple of 128, with the best available instruction set.
// Eight vector accumulators, so that only reading the bytes takes time.
[[nodiscard]] float stream_sum(const float* data, int count);

}  // namespace posed::bench
