// Training of a StyleModel from clips. Cold; it reads no clock and prints nothing; progress goes to
// a callback.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "models/style/model/style_model.hpp"
#include "models/style/train/dataset.hpp"
#include "models/style/train/target_training.hpp"
#include "models/style/train/training_check.hpp"

namespace posed::style {

enum class TrainMode : std::uint8_t {
  kDefault,  // per-clip harmonic cycles, mean difference + GP on the residual, length by leave-out
  kPaper,    // Sato et al.: MGPM mean cycles, their kernel, evidence maximised by SCG
};

Result<TrainMode> mode_from_name(std::string_view name);

struct TrainingVerdict;  // train_report.hpp

// What training found out on its way; valid during the call that gets it.
struct Findings {
  const Dataset& dataset;
  const std::vector<Lesson>& lessons;        // one a target
  const std::vector<Learnt>& learnt;         // [lesson]
  const std::vector<TrainingCheck>& checks;  // [lesson]
  const TrainingVerdict& verdict;
};

struct TrainOptions {
  std::string target;  // the group whose style is learnt; every group that is no target is a source
  std::vector<std::string> more_targets{};  // whose styles the same model has, too
  TrainMode mode = TrainMode::kDefault;
  DatasetOptions dataset;
  std::function<void(const Findings&)> look{};  // called once, when all is learnt
};

// Several styles share the sources, the kernel and the poses; otherwise each is trained
// independently. Clips that cannot be learnt from give an error of one sentence that names the
// clip. The report (what `train --json` prints, without the seconds) is in the model; its `usable`,
// `problems`, `warnings` and `verdict` state whether the model is fit for use (training_check.hpp).
Result<StyleModel> train_style(const std::vector<TrainingClip>& clips, const TrainOptions& options);

}  // namespace posed::style
