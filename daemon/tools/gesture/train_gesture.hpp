// Training a gesture model with a progress bar; shared by `train gesture` and the demo.
#pragma once

#include <filesystem>
#include <vector>

#include "daemon/tools/command/ranks.hpp"
#include "models/gesture/gesture_model.hpp"
#include "models/gesture/train.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct GestureTraining {
  gesture::GestureModel model;
  gesture::TrainFindings findings;
  double seconds = 0.0;  // of the training itself
};

// Trains the model and writes it to `out`. Draws progress on stderr; Ctrl-C ends it with an error
// and without a file. `ranks` share the work; one of them writes.
Result<GestureTraining> train_gesture_and_save(const std::vector<gesture::Recording>& recordings,
                                               gesture::TrainOptions options,
                                               const std::filesystem::path& out, Ranks& ranks);

}  // namespace posed::tools
