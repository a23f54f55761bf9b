// Plot: lines, bands and marks between two axes, each with its unit. Cold.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/tools/report/axis.hpp"
#include "daemon/tools/report/page.hpp"

namespace posed::report {

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

}  // namespace posed::report
