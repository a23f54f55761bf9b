// The reports of `posed train gesture` and `posed eval gesture`: what a gesture model performs, how
// it got there, and how it compares with recordings. Cold.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/report/gesture_sections.hpp"
#include "models/gesture/gesture_model.hpp"
#include "models/gesture/recording.hpp"
#include "models/gesture/tree_drawing.hpp"
#include "models/trajectory/state_information.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

// The curve of these labels, at look-aheads from 0 frames on.
Result<std::vector<report::LagError>> lag_curve(const trajectory::StateInformation& information,
                                                std::span<const int> labels);

// The paper's string where the model has its labels, else every label once.
[[nodiscard]] std::vector<int> labels_to_show(const gesture::GestureModel& model);

// The recordings' frames, one below the other [frame][channel]; at least one recording.
[[nodiscard]] gesture::FeatureMatrix all_poses(const std::vector<gesture::Recording>& recordings);

// What `posed train gesture --report` and `posed eval gesture --report` show.
struct GestureReport {
  std::string title, command;
  std::string recorded_by;  // what the recordings are: "the training recordings"
  std::vector<int> labels;  // what is performed; at least one
  std::string verdict;
  bool good = true;  // the verdict's news
  std::vector<std::string> warnings{};
  std::vector<report::LagError> curve{};  // empty: not computed yet
  clip::Clip body{};                      // of a model of bodies: whose figure is drawn
};

// `recordings`: what the model is compared with; without labels only its poses are, without any
// nothing is. `findings`: what `--json` prints.
Result<> write_gesture_report(const GestureReport& report,
                              const std::shared_ptr<const gesture::GestureModel>& model,
                              const std::vector<gesture::Recording>& recordings,
                              const Findings& findings, const std::filesystem::path& path);

}  // namespace posed::tools
