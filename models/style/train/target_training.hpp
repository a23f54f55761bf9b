// The data of a training by target, and the processes that are trained on them, which share kernel
// and poses (models/style/train/README.md, "Several styles"). Cold.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "models/style/model/style_model.hpp"
#include "models/style/train/dataset.hpp"
#include "models/style/train/difference_process.hpp"
#include "models/style/train/kernel_choice.hpp"

namespace posed::style {

inline constexpr double kLimitFactor = 1.5;  // of the largest difference in training

[[nodiscard]] bool is_in(const std::vector<std::string>& names, const std::string& name);

// The mean length of a stride of one motion.
[[nodiscard]] int cycle_frames(const Dataset& dataset, const std::string& motion);

// One of the styles of a model: its target, and the data without the clips of other targets.
struct Lesson {
  std::string target;
  Dataset own;                    // where there are other targets
  const Dataset* data = nullptr;  // `own`, or all
  std::vector<int> clips;         // which clips of all are in it, where there are other targets
};

// The result borrows `all`.
[[nodiscard]] std::vector<Lesson> lessons_of(const Dataset& all,
                                             const std::vector<std::string>& targets);

// A process, and what is known about how it was learnt.
struct Learnt {
  gp::Trained process;
  Eigen::MatrixXd differences;   // all differences in the training pairs [N x D]
  std::string length_chosen_by;  // "leave-out", "default" or "evidence"
  Way way{};                     // error on held-out walkers; unset if none could be held out
  // That error for each walker, and all kernels that were tried; empty where none was held out.
  std::vector<HeldOut> held_out{};
  std::vector<Way> ways{};  // [held_out]
  std::vector<TriedKernel> tried{};
  std::optional<RootFunction> root{};  // what the style does to the pelvis; unset without legs
};

// One process a lesson; they share kernel and poses.
Result<std::vector<Learnt>> learn_default(const Dataset& all, const std::vector<Lesson>& lessons,
                                          TaskRunner& tasks, const FoldProgress& progress);

// The method of Sato et al. (--mode paper): mean source cycle -> difference of the mean cycles,
// kernel values by evidence.
Result<std::vector<Learnt>> learn_paper(const Dataset& dataset, const std::string& target,
                                        TaskRunner& tasks, const FoldProgress& progress);

}  // namespace posed::style
