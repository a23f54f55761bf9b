// What a training reports: the numbers and sentences of `posed train style --json`, which the model
// keeps. Cold.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "models/style/train/train.hpp"

namespace posed::style {

// Whether the model is fit for use, over all its styles.
struct TrainingVerdict {
  bool usable = true;                           // of every style
  std::vector<std::string> problems, warnings;  // of several styles each begins with its name
  std::string sentence;                         // of several styles a line each
};
// `checks`: one a lesson.
[[nodiscard]] TrainingVerdict verdict_of(const std::vector<Lesson>& lessons,
                                         const std::vector<TrainingCheck>& checks);

// How each lesson was learnt, judged by held-out clips where there are some.
[[nodiscard]] std::vector<TrainingCheck> checks_of(const std::vector<Lesson>& lessons,
                                                   const std::vector<Learnt>& learnt);

// The report of one style is part of the whole one, those of several are a list in it.
[[nodiscard]] nlohmann::json whole_report(const Findings& findings);

}  // namespace posed::style
