// Training: labelled recordings in, a GestureModel out (models/gesture/README.md, "Estimation": one
// model for each label, from it one for each context, one tree for each state and finger). Cold; no
// clock, no printing: progress goes to a callback.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "models/gesture/questions.hpp"
#include "models/gesture/recording.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

struct TrainOptions {
  std::vector<Label> labels = built_in_labels();  // with the classes of every label
  int segmental_rounds = 2;                       // k-means along best paths
  int rounds = 8;                                 // of Baum-Welch, mono and then per context
  int embedded_rounds = 0;        // over whole recordings, where the labels are coarse
  double embedded_slack_s = 0.5;  // how far a border may then move from its label
  double mdl_factor = 1.0;        // of the trees' stop
  // Called with the step and how much of it is done; false stops the training.
  std::function<bool(std::string_view step, double fraction)> progress;
};

// All recordings are at one rate, which becomes the model's. Refuses recordings without segments
// and labels that are in no class. The report (what `train --json` prints, less the seconds) is in
// the model.
[[nodiscard]] Result<GestureModel> train_gesture(const std::vector<Recording>& recordings,
                                                 const TrainOptions& options);

// Each recorded label's pose while it is held: the mean over the last half of its segments, less
// their last tenth.
[[nodiscard]] std::vector<LabelPose> label_poses(const std::vector<Recording>& recordings);

}  // namespace posed::gesture
