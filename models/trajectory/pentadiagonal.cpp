#include "models/trajectory/pentadiagonal.hpp"

#include "models/trajectory/information_form.hpp"

// The same targets as the predictor's kernels (models/gp), so that one choice of instruction set
// applies to both.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "models/trajectory/pentadiagonal.cpp"
// Highway compiles this file once per target; Highway's own macros do not compile without warnings
// under our flags.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wsign-conversion"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>
#pragma GCC diagnostic pop

HWY_BEFORE_NAMESPACE();
namespace posed::trajectory::kernel::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Doubles = hn::CappedTag<double, kLanes>;
using Vec = hn::Vec<Doubles>;
constexpr int kWide = static_cast<int>(hn::MaxLanes(Doubles()));

HWY_INLINE Vec load(const double* row) { return hn::Load(Doubles(), row); }
HWY_INLINE Vec times(double factor, Vec v) { return hn::Mul(hn::Set(Doubles(), factor), v); }
HWY_INLINE Vec plus_times(Vec sum, double factor, Vec v) {
  return hn::MulAdd(hn::Set(Doubles(), factor), v, sum);
}

// A frame that is not eliminated yet: its diagonal, its band to the next frame, its right side.
struct Pending {
  Vec d0, d1, r;
};

HWY_INLINE Pending nothing() {
  const Vec zero = hn::Zero(Doubles());
  return {zero, zero, zero};
}

// The delta and delta-delta rows of one frame.
struct Dynamics {
  Vec p1, m1, p2, m2;
};
HWY_INLINE Dynamics dynamics_of(const double* information, std::ptrdiff_t stride) {
  return {load(information + kDelta * stride), load(information + kDeltaMean * stride),
          load(information + kDeltaDelta * stride), load(information + kDeltaDeltaMean * stride)};
}

HWY_INLINE void add_position(Pending& frame, const double* information, std::ptrdiff_t stride) {
  frame.d0 = hn::Add(frame.d0, load(information + kPosition * stride));
  frame.r = hn::Add(frame.r, load(information + kPositionMean * stride));
}

// Windows centred between `a` and `c` (models/trajectory/README.md, "Pentadiagonal solve"). Returns
// the band from `a` to `c`.
HWY_INLINE Vec add_centred(Pending& a, Pending& b, Pending& c, const Dynamics& d) {
  const Vec outer = plus_times(d.p2, 0.25, d.p1);
  const Vec inner = times(-2.0, d.p2);
  a.d0 = hn::Add(a.d0, outer);
  b.d0 = plus_times(b.d0, 4.0, d.p2);
  c.d0 = hn::Add(c.d0, outer);
  a.d1 = hn::Add(a.d1, inner);
  b.d1 = hn::Add(b.d1, inner);
  a.r = hn::Add(a.r, plus_times(d.m2, -0.5, d.m1));
  b.r = plus_times(b.r, -2.0, d.m2);
  c.r = hn::Add(c.r, plus_times(d.m2, 0.5, d.m1));
  return plus_times(d.p2, -0.25, d.p1);
}

// The same with the delta-delta window [1 + k, -2, 1 - k].
HWY_INLINE Vec add_skewed(Pending& a, Pending& b, Pending& c, const Dynamics& d, double k) {
  const double left = 1.0 + k;
  const double right = 1.0 - k;
  const Vec delta = times(0.25, d.p1);
  a.d0 = hn::Add(a.d0, plus_times(delta, left * left, d.p2));
  b.d0 = plus_times(b.d0, 4.0, d.p2);
  c.d0 = hn::Add(c.d0, plus_times(delta, right * right, d.p2));
  a.d1 = plus_times(a.d1, -2.0 * left, d.p2);
  b.d1 = plus_times(b.d1, -2.0 * right, d.p2);
  a.r = hn::Add(a.r, plus_times(times(left, d.m2), -0.5, d.m1));
  b.r = plus_times(b.r, -2.0, d.m2);
  c.r = hn::Add(c.r, plus_times(times(right, d.m2), 0.5, d.m1));
  return hn::Sub(times(left * right, d.p2), delta);
}

// The two coefficients that the boundary rule gives a window with one coefficient outside, at the
// beginning of the sequence; at its end they are in the opposite order, those of the delta negated.
struct Cut {
  double delta[2], curve[2];
};
HWY_INLINE Cut cut_of(Boundary boundary) {
  if (boundary == Boundary::kZero) return {{0.0, 0.5}, {-2.0, 1.0}};
  return {{-0.5, 0.5}, {-1.0, 1.0}};
}
HWY_INLINE Cut mirrored(const Cut& cut) {
  return {{-cut.delta[1], -cut.delta[0]}, {cut.curve[1], cut.curve[0]}};
}

HWY_INLINE void add_cut(Pending& a, Pending& b, const Dynamics& d, const Cut& cut) {
  const auto square = [&](Vec sum, int i, int j) {
    sum = plus_times(sum, cut.delta[i] * cut.delta[j], d.p1);
    return plus_times(sum, cut.curve[i] * cut.curve[j], d.p2);
  };
  a.d0 = square(a.d0, 0, 0);
  a.d1 = square(a.d1, 0, 1);
  b.d0 = square(b.d0, 1, 1);
  a.r = plus_times(plus_times(a.r, cut.delta[0], d.m1), cut.curve[0], d.m2);
  b.r = plus_times(plus_times(b.r, cut.delta[1], d.m1), cut.curve[1], d.m2);
}

// A sequence of one frame: what the boundary rule leaves of its windows is on the frame itself.
HWY_INLINE void add_lone(Pending& a, const Dynamics& d, Boundary boundary) {
  if (boundary != Boundary::kZero) return;  // hold: both windows are 0 for any value
  a.d0 = plus_times(a.d0, 4.0, d.p2);
  a.r = plus_times(a.r, -2.0, d.m2);
}

// x_a = z - f1 x_b - f2 x_c, and what that adds to b and c.
HWY_INLINE void settle(const Pending& a, Vec d2, Pending& b, Pending& c, double* factor,
                       std::ptrdiff_t stride) {
  const Vec v = hn::Div(hn::Set(Doubles(), 1.0), a.d0);
  const Vec f1 = hn::Mul(a.d1, v);
  const Vec f2 = hn::Mul(d2, v);
  b.d0 = hn::NegMulAdd(f1, a.d1, b.d0);
  b.d1 = hn::NegMulAdd(f1, d2, b.d1);
  b.r = hn::NegMulAdd(f1, a.r, b.r);
  c.d0 = hn::NegMulAdd(f2, d2, c.d0);
  c.r = hn::NegMulAdd(f2, a.r, c.r);
  const Doubles d;
  hn::Store(f1, d, factor);
  hn::Store(f2, d, factor + stride);
  hn::Store(hn::Mul(a.r, v), d, factor + 2 * stride);
  hn::Store(v, d, factor + 3 * stride);
}

// One pass over the frames for `count` vectors of channels from `column` on; several vectors at
// once, because each frame waits for the division of the frame before it.
template <int count>
HWY_INLINE void eliminate_columns(const System& s, std::ptrdiff_t column, double* const* factors) {
  const std::ptrdiff_t stride = s.stride;
  const int last = s.frames - 1;
  const bool cuts = s.boundary != Boundary::kDrop;
  Pending a[count], b[count], c[count];
  const auto at = [column](const double* rows, int v) { return rows + column + v * kWide; };
  for (int v = 0; v < count; ++v) {
    a[v] = b[v] = nothing();
    if (s.carry_in != nullptr) {
      const double* carry = at(s.carry_in, v);
      a[v] = {load(carry), load(carry + stride), load(carry + 2 * stride)};
      b[v] = {load(carry + 3 * stride), hn::Zero(Doubles()), load(carry + 4 * stride)};
    } else if (cuts) {
      const Dynamics first = dynamics_of(at(s.information[0], v), stride);
      if (last == 0) {
        add_lone(a[v], first, s.boundary);
      } else {
        add_cut(a[v], b[v], first, cut_of(s.boundary));
      }
    }
  }
  for (int i = 0; i <= last; ++i) {
    for (int v = 0; v < count; ++v) {
      c[v] = nothing();
      add_position(a[v], at(s.information[i], v), stride);
      Vec d2 = hn::Zero(Doubles());
      if (i + 2 <= last) {
        const Dynamics dynamics = dynamics_of(at(s.information[i + 1], v), stride);
        d2 = s.skew == nullptr ? add_centred(a[v], b[v], c[v], dynamics)
                               : add_skewed(a[v], b[v], c[v], dynamics, s.skew[i + 1]);
      } else if (cuts && i + 1 == last) {
        add_cut(a[v], b[v], dynamics_of(at(s.information[last], v), stride),
                mirrored(cut_of(s.boundary)));
      }
      settle(a[v], d2, b[v], c[v], factors[i] + column + v * kWide, stride);
      a[v] = b[v];
      b[v] = c[v];
      if (i == 0 && s.carry_out != nullptr) {
        const Doubles d;
        double* carry = s.carry_out + column + v * kWide;
        hn::Store(a[v].d0, d, carry);
        hn::Store(a[v].d1, d, carry + stride);
        hn::Store(a[v].r, d, carry + 2 * stride);
        hn::Store(b[v].d0, d, carry + 3 * stride);
        hn::Store(b[v].r, d, carry + 4 * stride);
      }
    }
  }
}

void eliminate(const System& system, double* const* factors) {
  constexpr int kTogether = 3;
  int column = 0;
  for (; column + kTogether * kWide <= system.stride; column += kTogether * kWide) {
    eliminate_columns<kTogether>(system, column, factors);
  }
  for (; column < system.stride; column += kWide) eliminate_columns<1>(system, column, factors);
}

void substitute(const double* const* factors, int frames, int first, int stride, double* x) {
  const std::ptrdiff_t wide_stride = stride;
  for (int column = 0; column < stride; column += kWide) {
    Vec next = hn::Zero(Doubles());
    Vec after = next;
    for (int i = frames - 1; i >= first; --i) {
      const double* factor = factors[i] + column;
      const Vec rest =
          hn::NegMulAdd(load(factor + wide_stride), after, load(factor + 2 * wide_stride));
      after = next;
      next = hn::NegMulAdd(load(factor), next, rest);
      hn::Store(next, Doubles(), x + (i - first) * wide_stride + column);
    }
  }
}

void variance(const double* const* factors, int frames, int first, int stride, double* out,
              int step) {
  const std::ptrdiff_t wide_stride = stride;
  for (int column = 0; column < stride; column += kWide) {
    Vec s11 = hn::Zero(Doubles());  // of frame i + 1, of i + 2, and between them
    Vec s22 = s11;
    Vec s12 = s11;
    for (int i = frames - 1; i >= first; --i) {
      const double* factor = factors[i] + column;
      const Vec f1 = load(factor);
      const Vec f2 = load(factor + wide_stride);
      const Vec s01 = hn::NegMulAdd(f1, s11, hn::Neg(hn::Mul(f2, s12)));
      const Vec s02 = hn::NegMulAdd(f1, s12, hn::Neg(hn::Mul(f2, s22)));
      const Vec s00 =
          hn::NegMulAdd(f1, s01, hn::NegMulAdd(f2, s02, load(factor + 3 * wide_stride)));
      s22 = s11;
      s12 = s01;
      s11 = s00;
      hn::Store(s11, Doubles(), out + static_cast<std::ptrdiff_t>(i - first) * step + column);
    }
  }
}

}  // namespace posed::trajectory::kernel::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace posed::trajectory::kernel {

HWY_EXPORT(eliminate);
HWY_EXPORT(substitute);
HWY_EXPORT(variance);

RT_SAFE void eliminate(const System& system, double* const* factors) noexcept {
  HWY_DYNAMIC_DISPATCH(eliminate)(system, factors);
}
RT_SAFE void substitute(const double* const* factors, int frames, int first, int stride,
                        double* x) noexcept {
  HWY_DYNAMIC_DISPATCH(substitute)(factors, frames, first, stride, x);
}
RT_SAFE void variance(const double* const* factors, int frames, int first, int stride, double* out,
                      int step) noexcept {
  HWY_DYNAMIC_DISPATCH(variance)(factors, frames, first, stride, out, step);
}

}  // namespace posed::trajectory::kernel
#endif  // HWY_ONCE
