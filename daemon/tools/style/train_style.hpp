// Training a style model with a progress bar; shared by `train style` and the demo.
#pragma once

#include <cstdint>
#include <filesystem>

#include "daemon/tools/command/findings.hpp"
#include "daemon/tools/command/ranks.hpp"
#include "daemon/tools/style/experiment.hpp"
#include "models/style/train/train_report.hpp"
#include "proto/frame/result.hpp"

namespace posed::tools {

struct StyleFiles {
  std::filesystem::path model;
  bool force = false;              // also a model that is unusable
  std::filesystem::path report{};  // an HTML page, of an unusable model, too; empty: none
};

struct StyleTraining {
  style::TrainingVerdict verdict;
  bool written = false;  // the model
  double seconds = 0.0;  // of the training
  Findings findings;     // without the verdict
};

// Reads the experiment's clips, trains and writes the model. Draws progress on stderr; Ctrl-C ends
// it with an error and without a file. `ranks` share the work; one of them writes.
Result<StyleTraining> train_and_save(const Experiment& experiment, std::uint64_t seed,
                                     const StyleFiles& files, Ranks& ranks);

}  // namespace posed::tools
