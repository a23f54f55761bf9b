#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/style_sections.hpp"

namespace posed::report {
namespace {

constexpr std::size_t kTies = 14;  // lines between poses of one phase

void include_path(const PosePaths::Path& path, Range& x, Range& y) {
  for (const Point& point : path.points) {
    x.add(point.x);
    y.add(point.y);
  }
}

std::string component(int place, double share) {
  return fmt::format("component {} of the input ({:.0f} % of its variance)", place, 100.0 * share);
}

void draw_path(const PosePaths::Path& path, std::size_t series, Plot& plot) {
  plot.line(path.name, series, path.points, true);
  if (!path.points.empty()) plot.marks({}, series, std::span(path.points).first(1));
}

}  // namespace

Figure pose_paths(const PosePaths& paths) {
  Range x;
  Range y;
  include_path(paths.input, x, y);
  include_path(paths.output, x, y);
  if (paths.goal) include_path(*paths.goal, x, y);
  Plot plot({component(1, paths.first_share), "deg", x},
            {component(2, paths.second_share), "deg", y}, {.height_px = 440.0});
  plot.make_scales_equal();
  const std::size_t count = std::min(paths.input.points.size(), paths.output.points.size());
  const std::size_t step = std::max<std::size_t>(1, count / kTies);
  for (std::size_t i = 0; i < count; i += step) {
    plot.tie(paths.input.points[i], paths.output.points[i]);
  }
  draw_path(paths.input, 0, plot);
  draw_path(paths.output, 1, plot);
  if (paths.goal) draw_path(*paths.goal, 2, plot);
  return {.title = "Paths of the poses over one stride: " + paths.what,
          .sentence =
              "Thin lines join the pose before and after styling at one phase; as their lengths "
              "and directions change along the stride, the style is no constant offset. The mark "
              "on each path is phase 0, the right thigh farthest in front.",
          .drawings = {plot.drawing()},
          .tables = {}};
}

}  // namespace posed::report
