#include "daemon/tools/gesture/lag_curve.hpp"
#include "daemon/tools/command/degrees.hpp"

#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "models/motion/naturalness.hpp"

namespace posed::tools {
namespace {

constexpr double kWidth = 640.0, kHeight = 400.0;
constexpr double kLeft = 64.0, kRight = 16.0, kTop = 40.0, kBottom = 52.0;

// Positions on the page; the vertical axis begins and ends at a power of ten.
struct Axes {
  double most_frames;
  int low, high;  // powers of ten

  [[nodiscard]] double x(double frames) const {
    return kLeft + (kWidth - kLeft - kRight) * frames / most_frames;
  }
  [[nodiscard]] double y(double deg) const {
    const double power = std::clamp<double>(std::log10(std::max(deg, 1e-12)), low, high);
    return kTop + (kHeight - kTop - kBottom) * (high - power) / (high - low);
  }
};

std::string grid(const Axes& axes, double rate_hz) {
  std::string svg;
  for (int power = axes.low; power <= axes.high; ++power) {
    const double y = axes.y(std::pow(10.0, power));
    svg += fmt::format(
        "<line x1='{}' y1='{:.1f}' x2='{}' y2='{:.1f}' stroke='#ddd'/>"
        "<text x='{}' y='{:.1f}' text-anchor='end'>{:g}</text>\n",
        kLeft, y, kWidth - kRight, y, kLeft - 6.0, y + 4.0, std::pow(10.0, power));
  }
  for (int frames = 0; frames <= static_cast<int>(axes.most_frames); frames += 5) {
    const double x = axes.x(frames);
    svg += fmt::format(
        "<line x1='{:.1f}' y1='{}' x2='{:.1f}' y2='{}' stroke='#ddd'/>"
        "<text x='{:.1f}' y='{}' text-anchor='middle'>{}</text>\n",
        x, kTop, x, kHeight - kBottom, x, kHeight - kBottom + 16.0, frames);
  }
  return svg + fmt::format(
                   "<text x='{}' y='{}' text-anchor='middle'>look-ahead, frames at {:g} "
                   "Hz</text>\n",
                   (kLeft + kWidth - kRight) / 2.0, kHeight - 14.0, rate_hz);
}

template <typename Value>
std::string line(const Axes& axes, std::span<const LagPoint> curve, const char* colour,
                 const Value& value) {
  std::string points, dots;
  for (const LagPoint& point : curve) {
    const double x = axes.x(point.frames);
    const double y = axes.y(value(point));
    points += fmt::format("{:.1f},{:.1f} ", x, y);
    dots += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='3' fill='{}'/>", x, y, colour);
  }
  return fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='2'/>{}\n", points,
                     colour, dots);
}

}  // namespace

std::vector<LagPoint> lag_curve(const trajectory::StateInformation& information,
                                std::span<const int> labels) {
  const auto rows_of = [&](const perform::PerformOptions& options) {
    return perform::recording_of(information.model(),
                                 perform::perform(information, labels, options))
        .angles_rad;
  };
  const motion::Rows full = rows_of({});
  const double jerk = motion::jerk_rms(full);
  std::vector<LagPoint> curve;
  for (const int frames : {0, 1, 2, 3, 4, 6, 8, 10, 12, 15, 20, 25, 30, 40}) {
    perform::PerformOptions options;
    options.look_ahead = frames;
    const motion::Rows rows = rows_of(options);
    const motion::Rows off = rows - full;
    curve.push_back(
        {frames, kDegrees * std::sqrt(off.squaredNorm() / static_cast<double>(off.size())),
         kDegrees * off.cwiseAbs().maxCoeff(), jerk > 0.0 ? motion::jerk_rms(rows) / jerk : 1.0});
  }
  return curve;
}

std::string draw_lag_curve(std::span<const LagPoint> curve, double rate_hz) {
  double least = 1.0;
  double most = 1.0;
  for (const LagPoint& point : curve) {
    least = std::min(least, std::max(point.rms_deg, 1e-4));
    most = std::max(most, point.max_deg);
  }
  const Axes axes{static_cast<double>(curve.back().frames),
                  static_cast<int>(std::floor(std::log10(least))),
                  static_cast<int>(std::ceil(std::log10(most * 1.001)))};
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0} {1}' width='{0}' height='{1}' "
      "font-family='sans-serif' font-size='12'>\n<rect width='100%' height='100%' fill='white'/>\n"
      "<text x='{2}' y='22' font-size='14'>Difference to the full solve, degrees</text>\n",
      kWidth, kHeight, kLeft);
  svg += grid(axes, rate_hz);
  svg += line(axes, curve, "#c33", [](const LagPoint& point) { return point.max_deg; });
  svg += line(axes, curve, "#247", [](const LagPoint& point) { return point.rms_deg; });
  svg += fmt::format(
      "<text x='{0}' y='22' fill='#c33' text-anchor='end'>largest</text>"
      "<text x='{1}' y='22' fill='#247' text-anchor='end'>rms</text>\n</svg>\n",
      kWidth - kRight - 40.0, kWidth - kRight);
  return svg;
}

}  // namespace posed::tools
