#include "daemon/tools/report/plot.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "proto/text/clean.hpp"

namespace posed::report {
namespace {

// 1, 2 or 5 times a power of ten: the largest step that gives at most `most` ticks.
double round_step(double extent, int most) {
  const double rough = extent / std::max(1, most);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= rough * (1.0 - 1e-9)) return factor * power;
  }
  return 10.0 * power;
}

std::string tick_text(double value) {
  const bool long_number = std::abs(value) >= 1e5 && std::abs(value) < 1e9;  // {:g}: 1e+05
  return long_number ? fmt::format("{:.0f}", value) : fmt::format("{:g}", value);
}

}  // namespace

void Range::add(double value) {
  if (!std::isfinite(value)) return;
  low = empty ? value : std::min(low, value);
  high = empty ? value : std::max(high, value);
  empty = false;
}

Axis::Axis(std::string title, std::string unit, const Range& range)
    : title_(std::move(title)), unit_(std::move(unit)) {
  if (range.empty) return;
  low_ = range.low;
  high_ = range.high;
  if (high_ - low_ > 1e-9 * std::max(std::abs(low_), std::abs(high_))) return;
  const double room = low_ == 0.0 ? 1.0 : 0.1 * std::abs(low_);  // all values are the same
  low_ -= room;
  high_ += room;
}

Axis Axis::logarithmic(std::string title, std::string unit, const Range& range) {
  Axis axis(std::move(title), std::move(unit), {});
  axis.logarithmic_ = true;
  axis.low_ = 0.1;
  axis.high_ = 1.0;
  if (range.empty || range.high <= 0.0) return axis;
  constexpr double kMaxRatio = 1e6;  // below, a value is as good as none
  const double least = std::max(range.low, range.high / kMaxRatio);
  axis.low_ = std::pow(10.0, std::floor(std::log10(least)));
  axis.high_ = std::pow(10.0, std::ceil(std::log10(range.high)));
  if (axis.high_ <= axis.low_) axis.high_ = 10.0 * axis.low_;
  return axis;
}

void Axis::place(double from_px, double to_px) {
  from_px_ = from_px;
  to_px_ = to_px;
}

bool Axis::shows(double value) const {
  return std::isfinite(value) && (!logarithmic_ || value > 0.0);
}

double Axis::px(double value) const {
  const double inside = std::clamp(value, low_, high_);
  const double share = logarithmic_ ? std::log(inside / low_) / std::log(high_ / low_)
                                    : (inside - low_) / (high_ - low_);
  return from_px_ + share * (to_px_ - from_px_);
}

std::vector<Tick> Axis::ticks(int most) const {
  std::vector<Tick> ticks;
  if (logarithmic_) {
    const double decades = std::round(std::log10(high_ / low_));
    const bool halves = 2.0 * decades + 1.0 <= most;  // room for 3 between 1 and 10
    for (double decade = 0.0; decade <= decades; ++decade) {
      const double value = low_ * std::pow(10.0, decade);
      ticks.push_back({value, tick_text(value)});
      if (halves && decade < decades) ticks.push_back({3.0 * value, tick_text(3.0 * value)});
    }
    return ticks;
  }
  const double step = round_step(high_ - low_, most);
  for (double k = std::ceil(low_ / step - 1e-9); k * step <= high_ + 1e-9 * step; ++k) {
    const double value = k == 0.0 ? 0.0 : k * step;  // never -0
    ticks.push_back({value, tick_text(value)});
  }
  if (ticks.empty()) ticks.push_back({low_, tick_text(low_)});
  return ticks;
}

void equal_scales(Axis& x, double width_px, Axis& y, double height_px) {
  const double scale = std::max((x.high() - x.low()) / width_px, (y.high() - y.low()) / height_px);
  const auto widen = [&](Axis& axis, double length_px) {
    const double middle = 0.5 * (axis.low() + axis.high());
    const double half = 0.5 * scale * length_px;
    axis.widen(middle - half, middle + half);
  };
  widen(x, width_px);
  widen(y, height_px);
}

namespace {

constexpr double kLeft_px = 64.0, kRight_px = 20.0, kTop_px = 14.0, kBottom_px = 48.0;
constexpr double kLegendRow_px = 20.0, kSample_px = 26.0, kMark_px = 4.5;
constexpr int kMaxAxisTicks = 8;

std::string words_at(std::string_view kind, double x_px, double y_px, std::string_view text) {
  return fmt::format("<text class=\"{}\"{}{}>{}</text>\n", kind, svg_attribute("x", x_px),
                     svg_attribute("y", y_px), escaped(text));
}

std::string line_at(std::string_view kind, const Point& from, const Point& to) {
  return fmt::format("<line class=\"{}\"{}{}{}{}/>\n", kind, svg_attribute("x1", from.x),
                     svg_attribute("y1", from.y), svg_attribute("x2", to.x),
                     svg_attribute("y2", to.y));
}

std::string dash_of(std::size_t series) {
  const auto pattern = dashes(series);
  return pattern.empty() ? "" : fmt::format(" stroke-dasharray=\"{}\"", pattern);
}

std::string polygon(const std::vector<Point>& corners, std::string_view kind) {
  std::string points;
  for (const Point& corner : corners) points += fmt::format("{:.1f},{:.1f} ", corner.x, corner.y);
  return fmt::format("<polygon class=\"{}\" points=\"{}\"/>\n", kind, points);
}

// Room that is taken [px].
struct Box {
  double left, top, right, bottom;

  static Box around(double x, double y, double half) {
    return {x - half, y - half, x + half, y + half};
  }
  [[nodiscard]] bool meets(const Box& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
};

// One mark, by series another shape: circle, square, triangle, diamond, cross ...
std::string mark_at(double x_px, double y_px, std::size_t series) {
  const std::string kind = series_class(series) + " fill";
  const double r = kMark_px;
  const auto corners = [&](std::vector<Point> around) {
    for (Point& corner : around) corner = {x_px + r * corner.x, y_px + r * corner.y};
    return polygon(around, kind);
  };
  switch (series % kSeries) {
    case 1:
      return corners({{-0.9, -0.9}, {0.9, -0.9}, {0.9, 0.9}, {-0.9, 0.9}});
    case 2:
      return corners({{0.0, -1.2}, {1.1, 0.8}, {-1.1, 0.8}});
    case 3:
      return corners({{0.0, -1.3}, {1.3, 0.0}, {0.0, 1.3}, {-1.3, 0.0}});
    case 4:
      return corners({{0.0, 1.2}, {1.1, -0.8}, {-1.1, -0.8}});
    case 5:
      return corners({{-0.4, -1.2},
                      {0.4, -1.2},
                      {0.4, -0.4},
                      {1.2, -0.4},
                      {1.2, 0.4},
                      {0.4, 0.4},
                      {0.4, 1.2},
                      {-0.4, 1.2},
                      {-0.4, 0.4},
                      {-1.2, 0.4},
                      {-1.2, -0.4},
                      {-0.4, -0.4}});
    case 6:
      return corners({{-1.3, -0.5}, {1.3, -0.5}, {1.3, 0.5}, {-1.3, 0.5}});
    default:
      return fmt::format("<circle class=\"{}\"{}{}{}/>\n", kind, svg_attribute("cx", x_px),
                         svg_attribute("cy", y_px), svg_attribute("r", r));
  }
}

}  // namespace

Plot::Plot(Axis x, Axis y, PlotSize size) : x_(std::move(x)), y_(std::move(y)), size_(size) {
  x_.place(kLeft_px, size_.width_px - kRight_px);
  y_.place(size_.height_px - kBottom_px, kTop_px);
}

void Plot::make_scales_equal() {
  equal_scales(x_, size_.width_px - kLeft_px - kRight_px, y_,
               size_.height_px - kTop_px - kBottom_px);
}

bool Plot::shows(const Point& point) const { return x_.shows(point.x) && y_.shows(point.y); }

void Plot::name_series(std::string_view name, std::size_t series, Sample sample) {
  if (name.empty() || std::ranges::find(names_, name, &Entry::name) != names_.end()) return;
  names_.push_back({std::string(name), series, sample});
}

void Plot::line(std::string_view name, std::size_t series, std::span<const Point> points,
                bool closed) {
  name_series(name, series, Sample::kLine);
  std::string path;
  int count = 0;
  const auto end = [&] {
    if (count > 1) {
      body_ += fmt::format("<polyline class=\"{} stroke\"{} points=\"{}\"/>\n",
                           series_class(series), dash_of(series), path);
    }
    path.clear();
    count = 0;
  };
  for (std::size_t i = 0; i < points.size() + (closed && !points.empty() ? 1 : 0); ++i) {
    const Point& point = points[i % points.size()];
    if (!shows(point)) {
      end();
      continue;
    }
    path += fmt::format("{:.1f},{:.1f} ", x_.px(point.x), y_.px(point.y));
    ++count;
  }
  end();
}

void Plot::band(std::string_view name, std::size_t series, std::span<const Point> low,
                std::span<const Point> high) {
  name_series(name, series, Sample::kBand);
  std::vector<Point> around;
  for (const Point& point : low) {
    if (shows(point)) around.push_back({x_.px(point.x), y_.px(point.y)});
  }
  for (std::size_t i = high.size(); i-- > 0;) {
    if (shows(high[i])) around.push_back({x_.px(high[i].x), y_.px(high[i].y)});
  }
  if (around.size() > 2) back_ += polygon(around, series_class(series) + " band");
}

void Plot::marks(std::string_view name, std::size_t series, std::span<const Point> points) {
  name_series(name, series, Sample::kMark);
  for (const Point& point : points) {
    if (shows(point)) body_ += mark_at(x_.px(point.x), y_.px(point.y), series);
  }
}

void Plot::word(const Point& beside, std::string_view text) {
  if (!shows(beside)) return;
  const double x_px = x_.px(beside.x);
  const bool left = x_px + 8.0 + text_px(text) > size_.width_px;  // no room on the right
  body_ += words_at(left ? "quiet end" : "quiet", x_px + (left ? -8.0 : 8.0), y_.px(beside.y) + 4.0,
                    text);
}

int Plot::name_points(std::span<const Point> points, std::span<const std::string> names) {
  constexpr double kLine_px = 13.0;
  assert(points.size() == names.size());
  std::vector<Box> taken;
  for (const Point& point : points) {
    if (shows(point)) taken.push_back(Box::around(x_.px(point.x), y_.px(point.y), kMark_px));
  }
  int homeless = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!shows(points[i])) continue;
    const double x = x_.px(points[i].x);
    const double y = y_.px(points[i].y);
    const double width = text_px(names[i]);
    // Right, left, above, below.
    const Point corners[]{{x + 8.0, y - 7.0},
                          {x - 8.0 - width, y - 7.0},
                          {x - width / 2.0, y - 8.0 - kLine_px},
                          {x - width / 2.0, y + 8.0}};
    bool placed = false;
    for (const Point& corner : corners) {
      const Box box{corner.x, corner.y, corner.x + width, corner.y + kLine_px};
      const bool inside = box.left >= kLeft_px && box.right <= size_.width_px && box.top >= 0.0 &&
                          box.bottom <= size_.height_px - kBottom_px;
      if (!inside || std::ranges::any_of(taken, [&](const Box& b) { return b.meets(box); })) {
        continue;
      }
      taken.push_back(box);
      body_ += words_at("quiet", box.left, box.bottom - 2.5, names[i]);
      placed = true;
      break;
    }
    homeless += placed ? 0 : 1;
  }
  return homeless;
}

void Plot::tie(const Point& from, const Point& to) {
  if (!shows(from) || !shows(to)) return;
  back_ += line_at("tie", {x_.px(from.x), y_.px(from.y)}, {x_.px(to.x), y_.px(to.y)});
}

void Plot::rule_at_x(double x, std::string_view words) {
  if (!x_.shows(x)) return;
  const double at = x_.px(x);
  body_ += line_at("rule", {at, kTop_px}, {at, size_.height_px - kBottom_px});
  body_ += words_at("quiet", at + 5.0, kTop_px + 12.0, words);
}

std::string Plot::grid() const {
  const double bottom = size_.height_px - kBottom_px;
  const double right = size_.width_px - kRight_px;
  std::string out;
  for (const Tick& tick : y_.ticks(static_cast<int>((bottom - kTop_px) / 36.0))) {
    const double at = y_.px(tick.value);
    out += line_at("grid", {kLeft_px, at}, {right, at});
    out += words_at("quiet end", kLeft_px - 7.0, at + 4.0, tick.text);
  }
  for (const Tick& tick : x_.ticks(kMaxAxisTicks)) {
    const double at = x_.px(tick.value);
    out += line_at("grid", {at, kTop_px}, {at, bottom});
    out += words_at("quiet mid", at, bottom + 17.0, tick.text);
  }
  out += words_at("mid", (kLeft_px + right) / 2.0, size_.height_px - 10.0, x_.label());
  const double middle = (kTop_px + bottom) / 2.0;
  out +=
      fmt::format("<text class=\"mid\" transform=\"translate(15 {:.1f}) rotate(-90)\">{}</text>\n",
                  middle, escaped(y_.label()));
  return out;
}

// Rows of samples with their names.
std::string Plot::legend(double& height_px) const {
  std::string out;
  double x = kLeft_px;
  double y = 13.0;
  for (const Entry& entry : names_) {
    const double width_px = kSample_px + 8.0 + text_px(entry.name) + 18.0;
    if (x > kLeft_px && x + width_px > size_.width_px) {
      x = kLeft_px;
      y += kLegendRow_px;
    }
    const double middle = y - 4.0;
    if (entry.sample == Sample::kBand) {
      out += fmt::format("<rect class=\"{} band\"{}{} width=\"{}\" height=\"10\"/>\n",
                         series_class(entry.series), svg_attribute("x", x),
                         svg_attribute("y", y - 9.0), kSample_px);
    } else if (entry.sample == Sample::kLine) {
      out += fmt::format(
          "<polyline class=\"{} stroke\"{} points=\"{:.1f},{:.1f} {:.1f},{:.1f}\"/>\n",
          series_class(entry.series), dash_of(entry.series), x, middle, x + kSample_px, middle);
    } else {
      out += mark_at(x + kSample_px / 2.0, middle, entry.series);
    }
    out += words_at("", x + kSample_px + 8.0, y, entry.name);
    x += width_px;
  }
  height_px = names_.empty() ? 0.0 : y + 7.0;
  return out;
}

Drawing Plot::drawing() const {
  double legend_px = 0.0;
  std::string elements = legend(legend_px);
  if (!headline_.empty()) {
    legend_px += kLegendRow_px;
    elements += words_at("head", kLeft_px, legend_px - 6.0, headline_);
  }
  elements += fmt::format("<g transform=\"translate(0 {:.1f})\">\n", legend_px) + grid() + back_ +
              body_ + "</g>\n";
  return {.width_px = size_.width_px,
          .height_px = size_.height_px + legend_px,
          .elements = std::move(elements)};
}

namespace {

constexpr double kBarsWidth_px = 820.0, kBar_px = 13.0, kBetween_px = 9.0, kAbove_px = 26.0;
constexpr double kBelow_px = 44.0, kNumber_px = 62.0, kMaxName_px = 300.0;

std::string shortened(const std::string& name) {
  constexpr std::size_t kMaxBytes = 42;
  return clean(name, kMaxBytes);
}

double names_px(const Bars& bars) {
  double widest = 40.0;
  for (const BarGroup& group : bars.groups) {
    widest = std::max(widest, text_px(shortened(group.name)));
  }
  return std::min(widest, kMaxName_px) + 14.0;
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
                       series_class(s), svg_attribute("x", x));
    out += fmt::format("<text{} y=\"14\">{}</text>\n", svg_attribute("x", x + 20.0),
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
        svg_attribute("x1", at), svg_attribute("x2", at), svg_attribute("y1", kAbove_px),
        svg_attribute("y2", bottom), svg_attribute("x", at), svg_attribute("y", bottom + 16.0),
        escaped(tick.text));
  }
  out += fmt::format("<text class=\"mid\"{}{}>{}</text>\n",
                     svg_attribute("x", (axis.px(axis.low()) + axis.px(axis.high())) / 2.0),
                     svg_attribute("y", bottom + 36.0), escaped(axis.label()));
  for (const BarRule& rule : bars.rules) {
    const double at = axis.px(rule.value);
    const bool left = at > kBarsWidth_px - 180.0;
    out += fmt::format("<line class=\"rule\"{}{}{}{}/><text class=\"quiet{}\"{}{}>{}</text>\n",
                       svg_attribute("x1", at), svg_attribute("x2", at),
                       svg_attribute("y1", kAbove_px - 8.0), svg_attribute("y2", bottom),
                       left ? " end" : "", svg_attribute("x", at + (left ? -4.0 : 4.0)),
                       svg_attribute("y", kAbove_px - 2.0), escaped(rule.words));
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
    out += fmt::format("<text class=\"end\"{}{}>{}</text>\n", svg_attribute("x", left - 8.0),
                       svg_attribute("y", y + (group_px - kBetween_px) / 2.0 + 4.0),
                       escaped(shortened(group.name)));
    for (std::size_t s = 0; s < std::min(series, group.values.size()); ++s) {
      const double top = y + kBar_px * static_cast<double>(s);
      if (!axis.shows(group.values[s])) continue;
      const double end = axis.px(group.values[s]);
      out += fmt::format("<rect class=\"{} fill\"{}{}{}{}/>\n", series_class(s),
                         svg_attribute("x", std::min(base, end)), svg_attribute("y", top),
                         svg_attribute("width", std::max(1.0, std::abs(end - base))),
                         svg_attribute("height", kBar_px - 2.0));
      out += fmt::format("<text class=\"quiet\"{}{}>{}</text>\n",
                         svg_attribute("x", std::max(base, end) + 5.0),
                         svg_attribute("y", top + 10.0), number_text(group.values[s], bars.digits));
    }
    y += group_px;
  }
  return {.width_px = kBarsWidth_px, .height_px = bottom + kBelow_px, .elements = std::move(out)};
}

Figure bars_figure(std::string title, std::string sentence, const Bars& bars) {
  return {.title = std::move(title),
          .sentence = std::move(sentence),
          .drawings = {draw_bars(bars)},
          .tables = {}};
}

}  // namespace posed::report
