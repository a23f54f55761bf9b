#include <spdlog/fmt/fmt.h>

#include "daemon/tools/report/gesture_sections.hpp"

namespace posed::report {

Figure lag_error(const std::vector<LagError>& curve, double rate_hz) {
  std::vector<Point> rms;
  std::vector<Point> largest;
  Range frames;
  Range error;
  Table table{.columns = {{"labels known ahead [frames]"},
                          {"[ms]"},
                          {"rms error [deg]"},
                          {"largest error [deg]"},
                          {"jerk over the full solve's [1]"}},
              .rows = {}};
  for (const LagError& point : curve) {
    rms.push_back({static_cast<double>(point.frames), point.rms_deg});
    largest.push_back({static_cast<double>(point.frames), point.max_deg});
    frames.add(point.frames);
    if (point.rms_deg > 0.0) error.add(point.rms_deg);
    error.add(point.max_deg);
    table.rows.push_back({std::to_string(point.frames),
                          number_text(1e3 * point.frames / rate_hz, 0),
                          number_text(point.rms_deg, 4), number_text(point.max_deg, 4),
                          number_text(point.jerk_ratio, 3)});
  }
  Plot plot({"labels known ahead", fmt::format("frames at {:g} Hz", rate_hz), frames},
            Axis::logarithmic("difference to knowing all labels", "deg", error));
  plot.line("largest of any angle", 1, largest);
  plot.marks({}, 1, largest);
  plot.line("rms over all angles", 0, rms);
  plot.marks({}, 0, rms);
  return {.title = "Lag against error",
          .sentence =
              "A stream learns its next labels only some frames ahead: where the lines "
              "have fallen below what the eye sees, a tenth of a degree, more waiting "
              "gains nothing.",
          .drawings = {plot.drawing()},
          .tables = {std::move(table)}};
}

}  // namespace posed::report
