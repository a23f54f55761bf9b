#include <algorithm>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/axis.hpp"
#include "daemon/tools/report/gesture_sections.hpp"
#include "daemon/tools/report/look.hpp"

namespace posed::report {
namespace {

constexpr double kDurationWidth_px = 760.0, kDurationLeft_px = 150.0, kDurationRow_px = 30.0;
constexpr double kDurationTop_px = 28.0;

std::string durations_grid(const Axis& axis, double bottom) {
  std::string out;
  for (const Tick& tick : axis.ticks(9)) {
    const double at = axis.px(tick.value);
    out += fmt::format("<line class=\"grid\"{}{}{}{}/><text class=\"quiet mid\"{}{}>{}</text>\n",
                       attribute("x1", at), attribute("x2", at), attribute("y1", kDurationTop_px),
                       attribute("y2", bottom), attribute("x", at), attribute("y", bottom + 16.0),
                       escaped(tick.text));
  }
  return out + fmt::format("<text class=\"mid\"{}{}>{}</text>\n",
                           attribute("x", (kDurationLeft_px + kDurationWidth_px) / 2.0),
                           attribute("y", bottom + 36.0), escaped(axis.label()));
}

std::string durations_row(const LabelDurations& label, const Axis& axis, double y) {
  std::string out = fmt::format("<text class=\"end\"{}{}>{}</text>\n",
                                attribute("x", kDurationLeft_px - 8.0), attribute("y", y + 15.0),
                                escaped(label.label + (label.recorded ? "" : " (never recorded)")));
  double from_s = 0.0;
  for (std::size_t s = 0; s < label.mean_s.size(); ++s) {
    const double to_s = from_s + label.mean_s[s];
    if (!axis.shows(to_s)) return out;
    const double x = axis.px(from_s);
    const double width = axis.px(to_s) - x;
    out += fmt::format("<rect class=\"cell {} fill\"{}{}{} height=\"20\"/>\n", series_class(s),
                       attribute("x", x), attribute("y", y), attribute("width", width));
    from_s = to_s;
  }
  return out;
}

}  // namespace

Figure state_durations(const std::vector<LabelDurations>& labels) {
  Range range;
  range.add(0.0);
  for (const LabelDurations& label : labels) {
    double sum_s = 0.0;
    for (const double mean_s : label.mean_s) sum_s += mean_s;
    range.add(sum_s);
  }
  Axis axis("time since the gesture began", "s", range);
  axis.place(kDurationLeft_px, kDurationWidth_px - 16.0);
  std::string out;
  double x = kDurationLeft_px;
  const std::size_t states = labels.empty() ? 0 : labels.front().mean_s.size();
  for (std::size_t s = 0; s < states; ++s) {
    out += fmt::format(
        "<rect class=\"{} fill\"{} y=\"6\" width=\"14\" height=\"11\"/>"
        "<text{} y=\"16\">state {}</text>\n",
        series_class(s), attribute("x", x), attribute("x", x + 19.0), s + 1);
    x += 84.0;
  }
  const double bottom = kDurationTop_px + kDurationRow_px * static_cast<double>(labels.size());
  out += durations_grid(axis, bottom);
  Table table{.columns = {{"gesture", false}}, .rows = {}};
  for (std::size_t s = 0; s < states; ++s) {
    table.columns.push_back({fmt::format("state {} [ms]", s + 1)});
  }
  double y = kDurationTop_px + 5.0;
  for (const LabelDurations& label : labels) {
    out += durations_row(label, axis, y);
    y += kDurationRow_px;
    std::vector<std::string> row{label.label};
    for (std::size_t s = 0; s < label.mean_s.size(); ++s) {
      row.push_back(number_text(1e3 * label.mean_s[s], 0) + " ± " +
                    number_text(1e3 * label.deviation_s[s], 0));
    }
    table.rows.push_back(std::move(row));
  }
  return {.title = "How long the states last",
          .sentence =
              "Each row is a gesture between gestures of its own kind: into the pose "
              "(states 1 and 2), the hold (3 and 4) and out of it (5). Equal rows share a "
              "leaf of the tree of durations. The table gives "
              "mean ± one standard deviation.",
          .drawings = {{.width_px = kDurationWidth_px,
                        .height_px = bottom + 44.0,
                        .elements = std::move(out)}},
          .tables = {std::move(table)}};
}

}  // namespace posed::report
