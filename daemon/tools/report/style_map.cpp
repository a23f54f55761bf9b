#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/style_sections.hpp"
#include "proto/text/clean.hpp"

namespace posed::report {
namespace {

constexpr double kMapRoom = 0.12;  // around the marks, of their extent

Axis map_axis(const std::string& what, const std::string& unit, int place, double share,
              Range range) {
  const double room = kMapRoom * (range.high - range.low);
  range.add(range.low - room);
  range.add(range.high + room);
  return {fmt::format("{}, component {} ({:.0f} %)", what, place, 100.0 * share), unit, range};
}

}  // namespace

Figure style_map(const StyleMap& map) {
  std::vector<std::string> groups;
  Range x;
  Range y;
  for (const StyleMark& mark : map.marks) {
    x.add(mark.x);
    y.add(mark.y);
    if (std::ranges::find(groups, mark.group) == groups.end()) groups.push_back(mark.group);
  }
  Plot plot(map_axis(map.of_axis, map.unit, 1, map.first_share, x),
            map_axis(map.of_axis, map.unit, 2, map.second_share, y), {.height_px = 420.0});
  plot.make_scales_equal();  // distances have a meaning, and two marks are no noise made large
  for (std::size_t g = 0; g < groups.size(); ++g) {
    std::vector<Point> points;
    for (const StyleMark& mark : map.marks) {
      if (mark.group == groups[g]) points.push_back({mark.x, mark.y});
    }
    plot.marks(clean_name(groups[g]), g, points);
  }
  std::vector<Point> points;
  std::vector<std::string> names;
  for (const StyleMark& mark : map.marks) {
    points.push_back({mark.x, mark.y});
    names.push_back(clean_name(mark.name));
  }
  std::string unnamed;
  if (const int homeless = plot.name_points(points, names); homeless > 0) {
    unnamed = fmt::format(" {} of {} marks stand too close to others for a name.", homeless,
                          map.marks.size());
  }
  return {.title = "Where the styles lie: " + map.what,
          .sentence =
              "Each mark is one person in one style: where the groups form islands, the "
              "styles can be told apart; where they mix, there is little to learn. The axes are "
              "the two "
              "directions of the largest variance, with their shares of it. " +
              map.explanation + unnamed,
          .drawings = {plot.drawing()},
          .tables = {}};
}

}  // namespace posed::report
