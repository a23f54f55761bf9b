#include "daemon/tools/report/plot.hpp"

#include <algorithm>
#include <utility>

#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/look.hpp"

namespace posed::report {
namespace {

constexpr double kLeft_px = 64.0, kRight_px = 20.0, kTop_px = 14.0, kBottom_px = 48.0;
constexpr double kLegendRow_px = 20.0, kSample_px = 26.0, kMark_px = 4.5;
constexpr int kMostTicks = 8;

std::string words_at(std::string_view kind, double x_px, double y_px, std::string_view text) {
  return fmt::format("<text class=\"{}\"{}{}>{}</text>\n", kind, attribute("x", x_px),
                     attribute("y", y_px), escaped(text));
}

std::string line_at(std::string_view kind, const Point& from, const Point& to) {
  return fmt::format("<line class=\"{}\"{}{}{}{}/>\n", kind, attribute("x1", from.x),
                     attribute("y1", from.y), attribute("x2", to.x), attribute("y2", to.y));
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
      return fmt::format("<circle class=\"{}\"{}{}{}/>\n", kind, attribute("cx", x_px),
                         attribute("cy", y_px), attribute("r", r));
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
  for (const Tick& tick : x_.ticks(kMostTicks)) {
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
                         series_class(entry.series), attribute("x", x), attribute("y", y - 9.0),
                         kSample_px);
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

}  // namespace posed::report
