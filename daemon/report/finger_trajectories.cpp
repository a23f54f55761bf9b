#include "daemon/report/gesture_sections.hpp"
#include "proto/text/clean.hpp"

namespace posed::report {
namespace {

// One scale for all fingers, so that they can be compared.
Range angles_of(const std::vector<FingerTrajectory>& fingers) {
  Range range;
  for (const FingerTrajectory& finger : fingers) {
    for (const auto* line : {&finger.recorded, &finger.low, &finger.high}) {
      for (const Point& point : *line) range.add(point.y);
    }
  }
  const double room = 0.12 * (range.high - range.low);
  range.add(range.high + room);  // for the labels' names
  return range;
}

}  // namespace

Figure finger_trajectories(const std::string& title, const std::string& sentence,
                           const std::vector<FingerTrajectory>& fingers,
                           const std::vector<LabelSpan>& labels) {
  Figure figure{.title = title, .sentence = sentence, .drawings = {}, .tables = {}};
  const Range angles = angles_of(fingers);
  Range time;
  for (const LabelSpan& label : labels) {
    time.add(label.from_s);
    time.add(label.to_s);
  }
  for (const FingerTrajectory& finger : fingers) {
    const bool first = figure.drawings.empty();  // only the first one needs the legend
    Plot plot({"time", "s", time}, {"flexion", "deg", angles},
              {.width_px = 900.0, .height_px = 180.0});
    plot.headline(finger.finger);
    plot.band(first ? "the model's band, two deviations on each side" : "", 1, finger.low,
              finger.high);
    plot.line(first ? "the model's most likely motion" : "", 1, finger.mean);
    if (!finger.recorded.empty()) plot.line(first ? "recorded" : "", 0, finger.recorded);
    for (const LabelSpan& label : labels) plot.rule_at_x(label.from_s, clean_name(label.label));
    figure.drawings.push_back(plot.drawing());
  }
  return figure;
}

}  // namespace posed::report
