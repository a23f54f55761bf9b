// What `posed train gesture --report` and `posed eval gesture --report` show. Cold.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "daemon/tools/gesture/lag_curve.hpp"
#include "models/gesture/gesture_model.hpp"
#include "models/gesture/recording.hpp"
#include "proto/clip/clip.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct GestureReport {
  std::string title, command;
  std::string recorded_by;        // what the recordings are: "the training recordings"
  std::vector<int> labels;        // what is performed; at least one
  bool good = true;               // the verdict's news
  std::vector<LagPoint> curve{};  // empty: not computed yet
  clip::Clip body{};              // of a model of bodies: whose figure is drawn
};

// `recordings`: what the model is compared with; without labels only its poses are, without any
// nothing is. `figures`: what `--json` prints.
[[nodiscard]] Result<> write_gesture_report(
    const GestureReport& report, const std::shared_ptr<const gesture::GestureModel>& model,
    const std::vector<gesture::Recording>& recordings, const nlohmann::json& figures,
    const std::filesystem::path& path);

}  // namespace posed::tools
