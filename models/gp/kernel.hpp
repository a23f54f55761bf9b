// The predictor's inner loops, compiled once per instruction set by Highway. All are RT-safe.
//
// Data lie in memory in the order in which they are read. A tile is up to 64 training points:
//
//   X [dims][width]        one row a dimension, one column a point
//   A [width][padded]      one row a point: its weights, padded with zeros to 16 floats
//
// There is no software prefetch: it makes a call up to a tenth faster with cold caches and a third
// slower with hot ones.
//
// Every sum has one fixed order that does not depend on the vector's length: distances run by
// dimension, outputs in two partial sums (even and odd points). With fused multiply-adds AVX2 and
// AVX-512 therefore give the same bits.
#pragma once

#include <cstdint>

#include "proto/frame/rt_safe.hpp"

namespace posed::gp::kernel {

inline constexpr int kTile = 64;      // points in a full tile
inline constexpr int kLanes = 16;     // floats: points and outputs are padded to this
inline constexpr int kMaxDims = 288;  // inputs and outputs

[[nodiscard]] constexpr int padded(int n) noexcept { return (n + kLanes - 1) / kLanes * kLanes; }

// A query. `present` lists the `present_count` available dimensions; null means that all are
// available.
struct Query {
  const float* q;
  const std::uint16_t* present;
  int present_count;
  float exponent;  // -mu log2(e) / 2, times dims / present_count
};

struct Tiles {
  const float* data;  // 64-byte aligned
  int points;         // padded to 16
  int dims;
  int outputs_padded;
};

// Several sets of weights for the points of Tiles, tile by tile [count][width][padded], 64-byte
// aligned, and how much each counts [count].
struct Blocks {
  const float* data;
  const float* shares;
  int count;
};

// sum_i k_i A_i into out [outputs_padded], where k_i = exp2(exponent * |q - x_i|^2).
void weighted_sum(const Tiles& tiles, const Query& query, float* out) noexcept;

// weighted_sum() with sum_s shares_s A_s for A; blocks without a share are not read. One block of
// share 1 gives the bits of weighted_sum() with these weights.
RT_SAFE void blended_sum(const Tiles& tiles, const Blocks& blocks, const Query& query,
                         float* out) noexcept;

// Squared distances from q to the points of a tile of X alone [dims][kTile], 64-byte aligned, with
// a product and a sum for each step: every instruction set gives the same bits.
struct Parts {
  const float* q;
  const std::uint16_t* present;  // the dimensions that count, and whose they are
  const std::uint8_t* part;
  int count;
};

// Adds those of each part to its row of `sums` [parts][kTile], and writes those of all into `whole`
// [kTile]; both are 64-byte aligned.
RT_SAFE void squares_of_parts(const float* tile, const Parts& query, float* sums,
                              float* whole) noexcept;

// out = 2^x for x <= 0, exactly 0 below -125. count: a multiple of 16. For tests.
void exp2_of(const float* x, int count, float* out) noexcept;

// Bit of the Highway target in use.
[[nodiscard]] std::int64_t target() noexcept;

}  // namespace posed::gp::kernel
