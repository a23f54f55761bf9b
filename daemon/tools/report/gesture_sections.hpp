// The figures of a report on gestures, each made of plain numbers (figures 3, 5 and 6 of Takamido
// et al.; models/gesture/README.md, "References"). Cold.
#pragma once

#include <string>
#include <vector>

#include "daemon/tools/picture/strip.hpp"
#include "daemon/tools/report/page.hpp"
#include "daemon/tools/report/plot.hpp"
#include "models/gesture/tree_drawing.hpp"

namespace posed::report {

// Figure 3: the questions that lead a gesture among its neighbours to its poses.
[[nodiscard]] Figure decision_trees(const std::string& title,
                                    const std::vector<gesture::DrawnTree>& trees, bool folded);

// How long each of the five states lasts.
struct LabelDurations {
  std::string label;
  bool recorded = true;
  std::vector<double> mean_s, deviation_s;  // [state]
};
[[nodiscard]] Figure state_durations(const std::vector<LabelDurations>& labels);

// An angle of each finger, or of each group of joints, as it was recorded and as the model performs
// the same labels.
struct AngleTrajectory {
  std::string name;
  std::vector<Point> recorded;         // s, deg; may be empty
  std::vector<Point> mean, low, high;  // the performance, with its band of two deviations
};
struct LabelSpan {
  std::string label;
  double from_s = 0.0, to_s = 0.0;
};
// `angle`: what the vertical axis shows, "flexion".
[[nodiscard]] Figure angle_trajectories(const std::string& title, const std::string& sentence,
                                        const std::string& angle,
                                        const std::vector<AngleTrajectory>& trajectories,
                                        const std::vector<LabelSpan>& labels);

// Figures 5 and 6: a hand, or a body on its ground, in rows of poses.
[[nodiscard]] Figure gesture_strip(const std::string& title, const std::string& sentence,
                                   const std::vector<picture::StripRow>& rows,
                                   const picture::Camera& camera, bool ground);

// How far a performance that knows its labels only so many frames ahead is from one that knows all.
struct LagError {
  int frames = 0;  // of look-ahead
  double rms_deg = 0.0, max_deg = 0.0;
  double jerk_ratio = 0.0;  // relative to the performance that knows all
};
[[nodiscard]] Figure lag_error(const std::vector<LagError>& curve, double rate_hz);

// Which label is recognised where another is.
struct Confusion {
  std::vector<std::string> labels;         // columns
  std::vector<std::string> given;          // rows
  std::vector<std::vector<double>> share;  // [given][label], 0 to 1; a row sums to 1
  std::vector<int> frames;                 // [given]
  std::string measured_on;                 // "the training recordings"
};
[[nodiscard]] Figure label_confusion(const Confusion& confusion);

}  // namespace posed::report
