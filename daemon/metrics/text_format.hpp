// TextFormat: writes metrics in the text format of Prometheus (version 0.0.4): a family has a name,
// a type and a sentence of help, and samples with labels below. Pure. Cold.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/publish/duration_buckets.hpp"

namespace posed::metrics {

inline constexpr std::string_view kTextType = "text/plain; version=0.0.4; charset=utf-8";

// A label and its value, which may be any text.
using Label = std::pair<std::string_view, std::string_view>;
using Labels = std::initializer_list<Label>;

class TextFormat {
 public:
  // Begins the next family. Those of `counter` only grow and their names end in _total; samples of
  // a `gauge` go up and down.
  void counter(std::string_view name, std::string_view help) { family(name, "counter", help); }
  void gauge(std::string_view name, std::string_view help) { family(name, "gauge", help); }
  // Of durations [s].
  void histogram(std::string_view name, std::string_view help) { family(name, "histogram", help); }

  // Samples of the family that was begun last.
  void sample(Labels labels, std::uint64_t value);
  void sample(Labels labels, double value);
  void sample(Labels labels, const publish::DurationBuckets::Counts& counts);

  [[nodiscard]] std::string finish() { return std::move(text_); }

 private:
  void family(std::string_view name, std::string_view type, std::string_view help);
  // Writes the name with `ending` and the labels, with `le` as the last one if it is not empty.
  void begin(std::string_view ending, Labels labels, std::string_view le);

  std::string text_;
  std::string name_;
};

}  // namespace posed::metrics
