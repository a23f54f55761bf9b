#include "daemon/tools/report/bars.hpp"

#include <algorithm>
#include <cmath>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/axis.hpp"
#include "daemon/tools/report/look.hpp"
#include "proto/text/clean.hpp"

namespace posed::report {
namespace {

constexpr double kBarsWidth_px = 820.0, kBar_px = 13.0, kBetween_px = 9.0, kAbove_px = 26.0;
constexpr double kBelow_px = 44.0, kNumber_px = 62.0, kMostName_px = 300.0;

std::string shortened(const std::string& name) {
  constexpr std::size_t kMostBytes = 42;
  return clean(name, kMostBytes);
}

double names_px(const Bars& bars) {
  double widest = 40.0;
  for (const BarGroup& group : bars.groups) {
    widest = std::max(widest, text_px(shortened(group.name)));
  }
  return std::min(widest, kMostName_px) + 14.0;
}

Axis axis_of(const Bars& bars) {
  Range range;
  for (const BarGroup& group : bars.groups) range.add(group.values);
  for (const BarRule& rule : bars.rules) range.add(rule.value);
  if (bars.logarithmic) {
    // No bar is short only because the axis begins there.
    range.add(range.low / 3.0);
    return Axis::logarithmic(bars.quantity, bars.unit, range);
  }
  range.add(0.0);
  return {bars.quantity, bars.unit, range};
}

std::string legend_of(const Bars& bars, double left) {
  if (bars.series.size() < 2) return {};
  std::string out;
  double x = left;
  for (std::size_t s = 0; s < bars.series.size(); ++s) {
    out += fmt::format("<rect class=\"{} fill\"{} y=\"4\" width=\"14\" height=\"11\"/>\n",
                       series_class(s), attribute("x", x));
    out += fmt::format("<text{} y=\"14\">{}</text>\n", attribute("x", x + 20.0),
                       escaped(bars.series[s]));
    x += 44.0 + text_px(bars.series[s]);
  }
  return out;
}

// Grid, axis and rules; the rules' words stand at the bottom, one row each.
std::string frame_of(const Bars& bars, const Axis& axis, double bottom) {
  std::string out;
  for (const Tick& tick : axis.ticks(9)) {
    const double at = axis.px(tick.value);
    out += fmt::format(
        "<line class=\"grid\"{0}{1}{2}{3}/><text class=\"quiet mid\"{4}{5}>{6}</text>\n",
        attribute("x1", at), attribute("x2", at), attribute("y1", kAbove_px),
        attribute("y2", bottom), attribute("x", at), attribute("y", bottom + 16.0),
        escaped(tick.text));
  }
  out += fmt::format("<text class=\"mid\"{}{}>{}</text>\n",
                     attribute("x", (axis.px(axis.low()) + axis.px(axis.high())) / 2.0),
                     attribute("y", bottom + 36.0), escaped(axis.label()));
  for (const BarRule& rule : bars.rules) {
    const double at = axis.px(rule.value);
    const bool left = at > kBarsWidth_px - 180.0;
    out += fmt::format("<line class=\"rule\"{}{}{}{}/><text class=\"quiet{}\"{}{}>{}</text>\n",
                       attribute("x1", at), attribute("x2", at), attribute("y1", kAbove_px - 8.0),
                       attribute("y2", bottom), left ? " end" : "",
                       attribute("x", at + (left ? -4.0 : 4.0)), attribute("y", kAbove_px - 2.0),
                       escaped(rule.words));
  }
  return out;
}

}  // namespace

Drawing draw_bars(const Bars& bars) {
  const double left = names_px(bars);
  Axis axis = axis_of(bars);
  axis.place(left, kBarsWidth_px - kNumber_px);
  const std::size_t series = std::max<std::size_t>(1, bars.series.size());
  const double group_px = kBar_px * static_cast<double>(series) + kBetween_px;
  const double bottom = kAbove_px + group_px * static_cast<double>(bars.groups.size());
  std::string out = legend_of(bars, left) + frame_of(bars, axis, bottom);
  const double base = axis.px(bars.logarithmic ? axis.low() : 0.0);
  double y = kAbove_px + kBetween_px / 2.0;
  for (const BarGroup& group : bars.groups) {
    out += fmt::format("<text class=\"end\"{}{}>{}</text>\n", attribute("x", left - 8.0),
                       attribute("y", y + (group_px - kBetween_px) / 2.0 + 4.0),
                       escaped(shortened(group.name)));
    for (std::size_t s = 0; s < std::min(series, group.values.size()); ++s) {
      const double top = y + kBar_px * static_cast<double>(s);
      if (!axis.shows(group.values[s])) continue;
      const double end = axis.px(group.values[s]);
      out += fmt::format("<rect class=\"{} fill\"{}{}{}{}/>\n", series_class(s),
                         attribute("x", std::min(base, end)), attribute("y", top),
                         attribute("width", std::max(1.0, std::abs(end - base))),
                         attribute("height", kBar_px - 2.0));
      out += fmt::format("<text class=\"quiet\"{}{}>{}</text>\n",
                         attribute("x", std::max(base, end) + 5.0), attribute("y", top + 10.0),
                         number_text(group.values[s], bars.digits));
    }
    y += group_px;
  }
  return {.width_px = kBarsWidth_px, .height_px = bottom + kBelow_px, .elements = std::move(out)};
}

}  // namespace posed::report
