#include "models/smooth/speed_prior.hpp"

#include "models/trajectory/information_form.hpp"

// The same targets as the predictor's kernels (models/gp), so that one choice of instruction set
// applies to all.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "models/smooth/speed_prior.cpp"
// Highway compiles this file once per target; Highway's own macros do not compile without warnings
// under our flags.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#pragma GCC diagnostic pop

HWY_BEFORE_NAMESPACE();
namespace posed::smooth::kernel::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, trajectory::kLanes>;
using Vec = hn::Vec<Doubles>;
constexpr int kWide = static_cast<int>(hn::MaxLanes(Doubles()));

// The sum of kLanes channels in one fixed order, whatever the vector's length.
HWY_INLINE double lane_sum(const double* lanes) {
  return ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) +
         ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]));
}

void sum_speeds(const double* x, int frames, int stride, const double* step_s, const double* active,
                double* sum, double* hand) {
  const Doubles d;
  for (int column = 0; column < stride; column += kWide) hn::Store(hn::Zero(d), d, sum + column);
  hand[0] = 0.0;
  for (int i = 0; i < frames; ++i) {
    const double* const now = x + static_cast<std::ptrdiff_t>(i == 0 ? 1 : i) * stride;
    const double* const before = now - stride;
    const double* const from = sum + static_cast<std::ptrdiff_t>(i) * stride;
    double* const to = sum + static_cast<std::ptrdiff_t>(i + 1) * stride;
    const Vec per_s = hn::Set(d, 1.0 / step_s[i == 0 ? 1 : i]);
    HWY_ALIGN double lanes[trajectory::kLanes] = {};
    for (int column = 0; column < stride; column += kWide) {
      const Vec difference = hn::Sub(hn::Load(d, now + column), hn::Load(d, before + column));
      const Vec speed = hn::Mul(hn::Mul(difference, difference), per_s);
      hn::Store(hn::Add(hn::Load(d, from + column), speed), d, to + column);
      double* const lane = lanes + column % trajectory::kLanes;
      hn::Store(hn::MulAdd(speed, hn::Load(d, active + column), hn::Load(d, lane)), d, lane);
    }
    hand[i + 1] = hand[i] + lane_sum(lanes);
  }
}

void set_precision(const double* sum_from, const double* sum_to, int stride, const Speed& speed,
                   const Spread& spread, const Steady& steady, const Prior& out) {
  const Doubles d;
  const Vec one = hn::Set(d, 1.0);
  const Vec hand = hn::Set(d, speed.hand);
  const Vec per_s = hn::Set(d, speed.per_s);
  const Vec tight = hn::Set(d, steady.root);
  for (int column = 0; column < stride; column += kWide) {
    const Vec passed = hn::Sub(hn::Load(d, sum_to + column), hn::Load(d, sum_from + column));
    const Vec s = hn::MulAdd(passed, per_s, hand);
    const Vec loose = hn::Load(d, steady.loose + column);
    const Vec delta_variance =
        hn::MulAdd(hn::Set(d, spread.delta_slope), s, hn::Set(d, spread.delta_base));
    const Vec density =
        hn::MulAdd(hn::Set(d, spread.density_slope), s, hn::Set(d, spread.density_base));
    const Vec root = hn::MulAdd(loose, hn::Sub(hn::Sqrt(hn::Sqrt(density)), tight), tight);
    const Vec root2 = hn::Mul(root, root);
    const Vec variance = hn::Mul(hn::Set(d, spread.delta_delta_s3), hn::Mul(root2, root2));
    hn::Store(hn::Div(loose, delta_variance), d, out.delta + column);
    hn::Store(hn::Div(one, variance), d, out.delta_delta + column);
    hn::Store(density, d, out.density + column);
  }
}

}  // namespace posed::smooth::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace posed::smooth::kernel {

HWY_EXPORT(sum_speeds);
HWY_EXPORT(set_precision);

RT_SAFE void sum_speeds(const double* x, int frames, int stride, const double* step_s,
                        const double* active, double* sum, double* hand) noexcept {
  HWY_DYNAMIC_DISPATCH(sum_speeds)(x, frames, stride, step_s, active, sum, hand);
}

RT_SAFE void set_precision(const double* sum_from, const double* sum_to, int stride,
                           const Speed& speed, const Spread& spread, const Steady& steady,
                           const Prior& out) noexcept {
  HWY_DYNAMIC_DISPATCH(set_precision)(sum_from, sum_to, stride, speed, spread, steady, out);
}

}  // namespace posed::smooth::kernel
#endif
