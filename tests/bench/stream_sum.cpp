#include "tests/bench/stream_sum.hpp"

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "tests/bench/stream_sum.cpp"
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#pragma GCC diagnostic pop

HWY_BEFORE_NAMESPACE();
namespace posed::bench::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

float stream_sum(const float* HWY_RESTRICT data, int count) {
  const hn::CappedTag<float, 16> d;
  constexpr int kWide = static_cast<int>(hn::MaxLanes(d));
  hn::Vec<decltype(d)> sum[8];
  for (auto& part : sum) part = hn::Zero(d);
  for (int i = 0; i < count; i += 8 * kWide) {
    for (int s = 0; s < 8; ++s) sum[s] = hn::Add(sum[s], hn::Load(d, data + i + s * kWide));
  }
  for (int s = 1; s < 8; ++s) sum[0] = hn::Add(sum[0], sum[s]);
  return hn::GetLane(hn::SumOfLanes(d, sum[0]));
}

}  // namespace posed::bench::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace posed::bench {

HWY_EXPORT(stream_sum);
float stream_sum(const float* data, int count) {
  return HWY_DYNAMIC_DISPATCH(stream_sum)(data, count);
}

}  // namespace posed::bench
#endif  // HWY_ONCE
