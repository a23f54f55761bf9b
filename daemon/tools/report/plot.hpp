// Drawings between two axes: lines, bands and marks (Plot) and bars in groups (draw_bars); each
// axis has its unit. All figures share one look: colours that colour-blind people can tell apart
// (Okabe and Ito), each with a mark and a dash pattern of its own, so that a grey print is
// readable, too. The page's style sheet gives the colours, lighter ones where the reader prefers
// dark. Cold.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/tools/report/page.hpp"
#include "proto/text/svg.hpp"

namespace posed::report {

// The least and the greatest of some values; those that are not finite do not count.
struct Range {
  double low = 0.0, high = 0.0;
  bool empty = true;

  void add(double value);
  void add(std::span<const double> values) {
    for (const double value : values) add(value);
  }
};

struct Tick {
  double value = 0.0;
  std::string text;
};

class Axis {
 public:
  // `title` without the unit; `unit` is never empty, because every axis says what it counts.
  Axis(std::string title, std::string unit, const Range& range);
  // The same with every decade of one length; values that are not positive are not on it.
  [[nodiscard]] static Axis logarithmic(std::string title, std::string unit, const Range& range);

  // Where the axis lies on the picture; `from_px` is the end of the low values.
  void place(double from_px, double to_px);

  // Whether the value has a place: it is finite and, on a logarithmic axis, positive.
  [[nodiscard]] bool shows(double value) const;
  // Needs shows(value). What is beyond an end is drawn at that end.
  [[nodiscard]] double px(double value) const;

  // Round values within the axis, at most about `most`, at least one.
  [[nodiscard]] std::vector<Tick> ticks(int most) const;
  [[nodiscard]] std::string label() const { return title_ + " [" + unit_ + "]"; }
  [[nodiscard]] double low() const { return low_; }
  [[nodiscard]] double high() const { return high_; }
  // Other ends; `low` is below `high`.
  void widen(double low, double high) {
    low_ = low;
    high_ = high;
  }

 private:
  std::string title_, unit_;
  double low_ = 0.0, high_ = 1.0;
  bool logarithmic_ = false;
  double from_px_ = 0.0, to_px_ = 1.0;
};

// Makes both axes' pixels equally long in value, around their middles; for paths in a plane.
void equal_scales(Axis& x, double width_px, Axis& y, double height_px);

struct Point {
  double x = 0.0, y = 0.0;
};

struct PlotSize {
  double width_px = 720.0, height_px = 360.0;
};

// What is not finite, or not positive on a logarithmic axis, leaves a gap: nothing that is drawn
// has a coordinate that is no number.
class Plot {
 public:
  Plot(Axis x, Axis y, PlotSize size = {});
  // For paths in a plane whose axes have one unit: both get one scale.
  void make_scales_equal();

  // `name` appears once in the legend; without one nothing does.
  void line(std::string_view name, std::size_t series, std::span<const Point> points,
            bool closed = false);
  // Between two lines over the same x.
  void band(std::string_view name, std::size_t series, std::span<const Point> low,
            std::span<const Point> high);
  void marks(std::string_view name, std::size_t series, std::span<const Point> points);
  void word(const Point& beside, std::string_view text);
  // A name beside each point, where it covers no other point and no other name; returns how many
  // found no place. `points` and `names` are equally many.
  int name_points(std::span<const Point> points, std::span<const std::string> names);
  // In bold above the plot.
  void headline(std::string_view text) { headline_ = text; }
  // A thin line between two points that belong together.
  void tie(const Point& from, const Point& to);
  // Straight through the whole plot, with words.
  void rule_at_x(double x, std::string_view words);

  [[nodiscard]] Drawing drawing() const;

 private:
  enum class Sample { kLine, kBand, kMark };
  struct Entry {
    std::string name;
    std::size_t series;
    Sample sample;
  };
  [[nodiscard]] bool shows(const Point& point) const;
  void name_series(std::string_view name, std::size_t series, Sample sample);
  [[nodiscard]] std::string grid() const;
  [[nodiscard]] std::string legend(double& height_px) const;

  Axis x_, y_;
  PlotSize size_;
  std::string headline_;
  std::string back_, body_;  // bands, and what is above them
  std::vector<Entry> names_;
};

struct BarGroup {
  std::string name;
  std::vector<double> values;  // one a series; not finite: there is none
};

struct BarRule {
  double value = 0.0;
  std::string words;
};

struct Bars {
  std::string quantity, unit;       // of the axis
  std::vector<std::string> series;  // their names, for the legend
  std::vector<BarGroup> groups;
  std::vector<BarRule> rules{};
  bool logarithmic = false;
  int digits = 1;  // of the numbers beside the bars
};

[[nodiscard]] Drawing draw_bars(const Bars& bars);
// A figure of bars alone.
[[nodiscard]] Figure bars_figure(std::string title, std::string sentence, const Bars& bars);

inline constexpr std::size_t kSeries = 7;

// A series' class in the style sheet: "s0" to "s6".
[[nodiscard]] inline std::string series_class(std::size_t series) {
  return "s" + std::to_string(series % kSeries);
}

[[nodiscard]] inline std::string_view dashes(std::size_t series) {
  constexpr std::array<std::string_view, kSeries> kDashes{"",    "7 4",     "2 3", "10 3 2 3",
                                                          "4 2", "1 2 6 2", "12 5"};
  return kDashes[series % kSeries];
}

// About the width of text in a figure.
[[nodiscard]] inline double text_px(std::string_view text) {
  constexpr double kLetter_px = 7.3;
  std::size_t letters = 0;  // of UTF-8
  for (const char c : text) letters += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U ? 1 : 0;
  return kLetter_px * static_cast<double>(letters);
}

}  // namespace posed::report
