// Axis: from values to pixels, and the round numbers that stand beside it. Cold.
#pragma once

#include <span>
#include <string>
#include <vector>

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

}  // namespace posed::report
