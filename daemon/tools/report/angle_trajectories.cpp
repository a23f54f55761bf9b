#include "daemon/tools/report/gesture_sections.hpp"
#include "proto/text/clean.hpp"

namespace posed::report {
namespace {

// One scale for all, so that they can be compared.
Range angles_of(const std::vector<AngleTrajectory>& trajectories) {
  Range range;
  for (const AngleTrajectory& angle : trajectories) {
    for (const auto* line : {&angle.recorded, &angle.low, &angle.high}) {
      for (const Point& point : *line) range.add(point.y);
    }
  }
  const double room = 0.12 * (range.high - range.low);
  range.add(range.high + room);  // for the labels' names
  return range;
}

}  // namespace

Figure angle_trajectories(const std::string& title, const std::string& sentence,
                          const std::string& angle,
                          const std::vector<AngleTrajectory>& trajectories,
                          const std::vector<LabelSpan>& labels) {
  Figure figure{.title = title, .sentence = sentence, .drawings = {}, .tables = {}};
  const Range angles = angles_of(trajectories);
  Range time;
  for (const LabelSpan& label : labels) {
    time.add(label.from_s);
    time.add(label.to_s);
  }
  for (const AngleTrajectory& shown : trajectories) {
    const bool first = figure.drawings.empty();  // only the first one needs the legend
    Plot plot({"time", "s", time}, {angle, "deg", angles}, {.width_px = 900.0, .height_px = 180.0});
    plot.headline(shown.name);
    plot.band(first ? "the model's band, two deviations on each side" : "", 1, shown.low,
              shown.high);
    plot.line(first ? "the model's most likely motion" : "", 1, shown.mean);
    if (!shown.recorded.empty()) plot.line(first ? "recorded" : "", 0, shown.recorded);
    for (const LabelSpan& label : labels) plot.rule_at_x(label.from_s, clean_name(label.label));
    figure.drawings.push_back(plot.drawing());
  }
  return figure;
}

}  // namespace posed::report
