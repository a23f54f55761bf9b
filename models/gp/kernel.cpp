#include "models/gp/kernel.hpp"

#include <algorithm>
#include <array>

#include "models/gp/isa.hpp"

// Four targets are enough: the baseline, SSE4, AVX2 and AVX-512. The first two have no fused
// multiply-add, give the same bits and are named "portable".
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "models/gp/kernel.cpp"
// Highway compiles this file once per target; Highway's own macros do not compile without warnings
// under our flags.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#pragma GCC diagnostic pop

HWY_BEFORE_NAMESPACE();
namespace posed::gp::kernel::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kLanes>;
using Vec = hn::Vec<Floats>;
constexpr int kWide = static_cast<int>(hn::MaxLanes(Floats()));  // floats in a vector

// 2^x for x <= 0. The polynomial has degree 6, so that its error is below rounding: relative error
// 1.9e-9 on [-0.5, 0.5], by the Remez algorithm. Below -125 the result is 0, not a denormal.
HWY_INLINE Vec exp2_negative(Vec x) {
  const Floats d;
  const auto tiny = hn::Lt(x, hn::Set(d, -125.0F));
  const auto inside = hn::Max(x, hn::Set(d, -125.0F));
  const auto whole = hn::NearestInt(inside);
  const auto r = hn::Sub(inside, hn::ConvertTo(d, whole));
  auto p = hn::Set(d, 1.5345812E-4F);
  p = hn::MulAdd(p, r, hn::Set(d, 1.3399931E-3F));
  p = hn::MulAdd(p, r, hn::Set(d, 9.6184890E-3F));
  p = hn::MulAdd(p, r, hn::Set(d, 5.5503288E-2F));
  p = hn::MulAdd(p, r, hn::Set(d, 2.4022647E-1F));
  p = hn::MulAdd(p, r, hn::Set(d, 6.9314721E-1F));
  p = hn::MulAdd(p, r, hn::Set(d, 1.0F));
  const hn::RebindToSigned<Floats> di;
  const auto bits = hn::Add(hn::BitCast(di, p), hn::ShiftLeft<23>(whole));
  return hn::IfThenZeroElse(tiny, hn::BitCast(d, bits));
}

// k of `count` vectors of points that start at `column` of a tile.
template <int count>
HWY_INLINE void kernel_columns(const float* HWY_RESTRICT X, int width, const Query& query,
                               float* HWY_RESTRICT k) {
  const Floats d;
  Vec sum[count];
  for (int v = 0; v < count; ++v) sum[v] = hn::Zero(d);
  for (int i = 0; i < query.present_count; ++i) {
    const int dim = query.present == nullptr ? i : query.present[i];
    const float* HWY_RESTRICT row = X + static_cast<std::ptrdiff_t>(dim) * width;
    const auto q = hn::Set(d, query.q[dim]);
    for (int v = 0; v < count; ++v) {
      const auto difference = hn::Sub(hn::Load(d, row + v * kWide), q);
      sum[v] = hn::MulAdd(difference, difference, sum[v]);
    }
  }
  const auto exponent = hn::Set(d, query.exponent);
  for (int v = 0; v < count; ++v) {
    hn::Store(exp2_negative(hn::Mul(exponent, sum[v])), d, k + v * kWide);
  }
}

HWY_INLINE void kernel_tile(const float* X, int width, const Query& query, float* k) {
  int column = 0;
  for (; column + 8 * kWide <= width; column += 8 * kWide) {
    kernel_columns<8>(X + column, width, query, k + column);
  }
  for (; column + 4 * kWide <= width; column += 4 * kWide) {
    kernel_columns<4>(X + column, width, query, k + column);
  }
  for (; column < width; column += kWide) kernel_columns<1>(X + column, width, query, k + column);
}

// Adds k_i A_i of one tile for `count` vectors of outputs, with separate sums for even and odd
// points.
template <int count>
HWY_INLINE void accumulate(const float* HWY_RESTRICT A, int stride, int width,
                           const float* HWY_RESTRICT k, float* HWY_RESTRICT even_sum,
                           float* HWY_RESTRICT odd_sum) {
  const Floats d;
  Vec even[count];
  Vec odd[count];
  for (int v = 0; v < count; ++v) even[v] = hn::Load(d, even_sum + v * kWide);
  for (int v = 0; v < count; ++v) odd[v] = hn::Load(d, odd_sum + v * kWide);
  for (int i = 0; i < width; i += 2) {
    const float* HWY_RESTRICT row = A + static_cast<std::ptrdiff_t>(i) * stride;
    const auto k0 = hn::Set(d, k[i]);
    const auto k1 = hn::Set(d, k[i + 1]);
    for (int v = 0; v < count; ++v) even[v] = hn::MulAdd(k0, hn::Load(d, row + v * kWide), even[v]);
    for (int v = 0; v < count; ++v) {
      odd[v] = hn::MulAdd(k1, hn::Load(d, row + stride + v * kWide), odd[v]);
    }
  }
  for (int v = 0; v < count; ++v) hn::Store(even[v], d, even_sum + v * kWide);
  for (int v = 0; v < count; ++v) hn::Store(odd[v], d, odd_sum + v * kWide);
}

HWY_INLINE void accumulate_tile(const float* A, int stride, int width, const float* k, float* even,
                                float* odd) {
  constexpr int kMaxVectors = kWide == 16 ? 4 : 6;  // vectors whose two sums stay in registers
  int column = 0;
  while (column < stride) {
    const int vectors = std::min((stride - column) / kWide, kMaxVectors);
    const float* from = A + column;
    switch (vectors) {
      case 6:
        accumulate<6>(from, stride, width, k, even + column, odd + column);
        break;
      case 5:
        accumulate<5>(from, stride, width, k, even + column, odd + column);
        break;
      case 4:
        accumulate<4>(from, stride, width, k, even + column, odd + column);
        break;
      case 3:
        accumulate<3>(from, stride, width, k, even + column, odd + column);
        break;
      case 2:
        accumulate<2>(from, stride, width, k, even + column, odd + column);
        break;
      default:
        accumulate<1>(from, stride, width, k, even + column, odd + column);
        break;
    }
    column += vectors * kWide;
  }
}

// The kernel's values tile by tile; `add(tile, width, k, even, odd)` adds what they weigh.
template <typename Add>
HWY_INLINE void sum_tiles(const Tiles& tiles, const Query& query, float* out, const Add& add) {
  HWY_ALIGN std::array<float, kMaxDims> even;
  HWY_ALIGN std::array<float, kMaxDims> odd;
  HWY_ALIGN std::array<float, kTile> k;
  const int padded_outputs = tiles.outputs_padded;
  std::fill_n(even.begin(), padded_outputs, 0.0F);
  std::fill_n(odd.begin(), padded_outputs, 0.0F);
  const float* tile = tiles.data;
  for (int point = 0; point < tiles.points; point += kTile) {
    const int width = std::min(kTile, tiles.points - point);
    kernel_tile(tile, width, query, k.data());
    const float* const A = tile + static_cast<std::ptrdiff_t>(tiles.dims) * width;
    add(A, width, k.data(), even.data(), odd.data());
    tile = A + static_cast<std::ptrdiff_t>(padded_outputs) * width;
  }
  const Floats d;
  for (int o = 0; o < padded_outputs; o += kWide) {
    hn::Store(hn::Add(hn::Load(d, even.data() + o), hn::Load(d, odd.data() + o)), d, out + o);
  }
}

void weighted_sum(const Tiles& tiles, const Query& query, float* out) {
  sum_tiles(tiles, query, out,
            [&](const float* A, int width, const float* k, float* even, float* odd) {
              accumulate_tile(A, tiles.outputs_padded, width, k, even, odd);
            });
}

void blended_sum(const Tiles& tiles, const Blocks& blocks, const Query& query, float* out) {
  const Floats d;
  const float* block = blocks.data;
  sum_tiles(tiles, query, out,
            [&](const float* /*A*/, int width, const float* k, float* even, float* odd) {
              HWY_ALIGN std::array<float, kTile> scaled;
              for (int s = 0; s < blocks.count; ++s) {
                if (blocks.shares[s] != 0.0F) {
                  const auto share = hn::Set(d, blocks.shares[s]);
                  for (int i = 0; i < width; i += kWide) {
                    hn::Store(hn::Mul(share, hn::Load(d, k + i)), d, scaled.data() + i);
                  }
                  accumulate_tile(block, tiles.outputs_padded, width, scaled.data(), even, odd);
                }
                block += static_cast<std::ptrdiff_t>(tiles.outputs_padded) * width;
              }
            });
}

void squares_of_parts(const float* HWY_RESTRICT tile, const Parts& query, float* HWY_RESTRICT sums,
                      float* HWY_RESTRICT whole) {
  constexpr int kVectors = std::min(4, kTile / kWide);  // whose sums stay in registers
  const Floats d;
  for (int column = 0; column < kTile; column += kVectors * kWide) {
    Vec all[kVectors];
    for (Vec& one : all) one = hn::Zero(d);
    for (int i = 0; i < query.count;) {
      const int part = query.part[i];
      float* HWY_RESTRICT row = sums + static_cast<std::ptrdiff_t>(part) * kTile + column;
      Vec own[kVectors];
      for (int v = 0; v < kVectors; ++v) own[v] = hn::Load(d, row + v * kWide);
      for (; i < query.count && query.part[i] == part; ++i) {
        const int dim = query.present[i];
        const float* HWY_RESTRICT x = tile + static_cast<std::ptrdiff_t>(dim) * kTile + column;
        const auto q = hn::Set(d, query.q[dim]);
        for (int v = 0; v < kVectors; ++v) {
          const auto difference = hn::Sub(q, hn::Load(d, x + v * kWide));
          const auto square = hn::Mul(difference, difference);
          own[v] = hn::Add(own[v], square);
          all[v] = hn::Add(all[v], square);
        }
      }
      for (int v = 0; v < kVectors; ++v) hn::Store(own[v], d, row + v * kWide);
    }
    for (int v = 0; v < kVectors; ++v) hn::Store(all[v], d, whole + column + v * kWide);
  }
}

void exp2_of(const float* x, int count, float* out) {
  const Floats d;
  for (int i = 0; i < count; i += kWide) {
    hn::StoreU(exp2_negative(hn::LoadU(d, x + i)), d, out + i);
  }
}

std::int64_t target() { return HWY_TARGET; }

}  // namespace posed::gp::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace posed::gp {
namespace kernel {

HWY_EXPORT(weighted_sum);
HWY_EXPORT(blended_sum);
HWY_EXPORT(squares_of_parts);
HWY_EXPORT(exp2_of);
HWY_EXPORT(target);

void weighted_sum(const Tiles& tiles, const Query& query, float* out) noexcept {
  HWY_DYNAMIC_DISPATCH(weighted_sum)(tiles, query, out);
}
void blended_sum(const Tiles& tiles, const Blocks& blocks, const Query& query,
                 float* out) noexcept {
  HWY_DYNAMIC_DISPATCH(blended_sum)(tiles, blocks, query, out);
}
void squares_of_parts(const float* tile, const Parts& query, float* sums, float* whole) noexcept {
  HWY_DYNAMIC_DISPATCH(squares_of_parts)(tile, query, sums, whole);
}
void exp2_of(const float* x, int count, float* out) noexcept {
  HWY_DYNAMIC_DISPATCH(exp2_of)(x, count, out);
}
std::int64_t target() noexcept { return HWY_DYNAMIC_DISPATCH(target)(); }

}  // namespace kernel

namespace {

constexpr std::int64_t kFused = HWY_AVX2 | HWY_AVX3;

struct Isa {
  std::string_view name;
  std::int64_t needs;  // target bits, one of which the CPU must have; 0: any CPU
  std::int64_t switches_off;
};
constexpr std::array<Isa, 4> kIsas{{{"auto", 0, 0},
                                    {"portable", 0, kFused},
                                    {"avx2", HWY_AVX2, HWY_AVX3},
                                    {"avx512", HWY_AVX3, 0}}};

}  // namespace

Result<> set_isa(std::string_view name) {
  const auto* isa = std::ranges::find(kIsas, name, &Isa::name);
  if (isa == kIsas.end()) {
    return misuse("unknown instruction set '" + std::string(name) +
                  "': use portable, avx2, avx512 or auto");
  }
  hwy::DisableTargets(0);
  if (isa->needs != 0 && (hwy::SupportedTargets() & isa->needs) == 0) {
    return fail("this CPU has no " + std::string(name) + ": use --isa auto");
  }
  hwy::DisableTargets(isa->switches_off);
  return {};
}

std::string_view isa_name() {
  const std::int64_t now = kernel::target();
  if ((now & kFused) == 0) return "portable";
  return now == HWY_AVX2 ? "avx2" : "avx512";
}

}  // namespace posed::gp
#endif  // HWY_ONCE
