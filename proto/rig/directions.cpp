#include "proto/rig/directions.hpp"

namespace posed::rig {
namespace {

Vec any_across(const Vec& v) { return direction(v.cross(std::abs(v.x()) < 0.9 ? kX : kY)); }

Mat basis(const Vec& a, const Vec& b) {
  Mat m;
  m.col(0) = direction(a);
  if (m.col(0).isZero()) m.col(0) = kX;
  const Vec rest = across(b, m.col(0));
  m.col(1) = rest.norm() > 1e-9 * b.norm() ? direction(rest) : any_across(m.col(0));
  m.col(2) = m.col(0).cross(m.col(1));
  return m;
}

}  // namespace

Mat minimal(const Vec& from, const Vec& to) {
  const Vec a = direction(from);
  const Vec b = direction(to);
  const Vec v = a.cross(b);
  const double cosine = a.dot(b);
  if (cosine < -1.0 + 1e-9) {
    const Vec p = any_across(a);
    return 2.0 * p * p.transpose() - Mat::Identity();
  }
  Mat k;
  k << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return Mat::Identity() + k + k * k / (1.0 + cosine);
}

Mat frame(const Vec& a, const Vec& to_a, const Vec& b, const Vec& to_b) {
  return basis(to_a, to_b) * basis(a, b).transpose();
}

Vec main_axis(const Vec& v) {
  return *std::ranges::max_element(kAxes, {}, [&v](const Vec& axis) { return axis.dot(v); });
}

std::optional<Vec> nearest_axis(const Vec& v, double limit_deg) {
  const Vec axis = main_axis(v);
  return angle_deg(axis, v) <= limit_deg ? std::optional(axis) : std::nullopt;
}

std::vector<Vec> axes_across(const Vec& v) {
  const Vec along = direction(v);
  std::vector<Vec> out;
  for (const Vec& axis : kAxes) {
    if (std::abs(axis.dot(along)) < 0.5) out.push_back(axis);
  }
  // A direction between the axes has only some of them across it, but at least one.
  if (out.empty()) out.push_back(main_axis(any_across(along)));
  return out;
}

double percentile(std::vector<double> values, double percent) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  const double at = percent / 100.0 * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(at);
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return values[low] + (values[high] - values[low]) * (at - static_cast<double>(low));
}

}  // namespace posed::rig
