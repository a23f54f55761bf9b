// The report of a training for people: its data, the size of the trees, and warnings. Cold.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "models/gesture/context_models.hpp"
#include "models/gesture/gesture_model.hpp"
#include "models/gesture/grow_tree.hpp"
#include "models/gesture/train.hpp"

namespace posed::gesture {

class TrainReport {
 public:
  // The arguments outlive the report.
  TrainReport(const std::vector<Recording>& recordings, const ContextModels& contexts,
              const Vocabulary& vocabulary);

  void add_tree(int state, int group, const GrownTree& tree);

  [[nodiscard]] TrainFindings findings() const;
  // One JSON object; the same training gives the same text.
  [[nodiscard]] std::string json_of(const GestureModel& model) const;

 private:
  [[nodiscard]] std::vector<std::string> warnings() const;
  [[nodiscard]] std::string mixed_warning() const;
  [[nodiscard]] bool swings(const std::string& label) const;  // empty: no leaf mixes classes
  [[nodiscard]] double apart_rad(int state, int group, const std::vector<int>& members) const;
  [[nodiscard]] int gestures_of(const std::string& label) const;

  const std::vector<Recording>& recordings_;
  const ContextModels& contexts_;
  const Vocabulary& vocabulary_;
  using Counts = std::array<std::vector<int>, kStates>;  // [state][group]
  Counts leaves_;
  // Numbers of leaves whose members' current labels belong to different classes. They matter in the
  // hold (states 3 and 4) where these classes also have different poses.
  Counts mixed_;
  std::vector<int> astray_;  // [group]
};

}  // namespace posed::gesture
