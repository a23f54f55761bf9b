// Training of a GestureModel from labelled recordings (models/gesture/README.md, "Estimation": one
// model for each label, from it one for each context, one tree for each state and finger). Cold; it
// reads no clock and prints nothing; progress goes to a callback.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "models/gesture/questions.hpp"
#include "models/gesture/recording.hpp"
#include "models/tasks.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// What a training found out on its way.
struct TrainFindings {
  std::size_t contexts = 0, moving_channels = 0;
  std::vector<std::string> warnings;  // each says what to record more of
};

struct TrainOptions {
  // The labels with their classes; without any the built-in ones of a hand.
  Vocabulary vocabulary = built_in_vocabulary();
  int segmental_rounds = 2;       // k-means along best paths
  int rounds = 8;                 // of Baum-Welch, for labels and then for contexts
  int embedded_rounds = 0;        // over whole recordings, for labels with imprecise borders
  double embedded_slack_s = 0.5;  // how far a border may then move from its label
  double mdl_factor = 1.0;        // factor on the trees' stopping threshold
  TaskRunner* tasks = nullptr;    // not owned; null: one task after another
  // Called with the step and how much of it is done; false stops the training.
  std::function<bool(std::string_view step, double fraction)> progress{};
  std::function<void(TrainFindings)> look{};  // called once, when all is learnt
  // A hand's held poses are learnt although nothing is none: for a source whose errors in one joint
  // go with those in others, as a camera's do (models/smooth/README.md, "HMM forward filter").
  bool held = false;
};

// All recordings are at one rate, which becomes the model's. Returns an error for recordings
// without segments and for labels that are in no class. The report (what `train --json` prints,
// without the seconds) is in the model.
Result<GestureModel> train_gesture(const std::vector<Recording>& recordings,
                                   const TrainOptions& options);

// The held pose of each recorded label: the mean over the last half of its segments, without their
// last tenth.
[[nodiscard]] std::vector<LabelPose> label_poses(const std::vector<Recording>& recordings);

}  // namespace posed::gesture
