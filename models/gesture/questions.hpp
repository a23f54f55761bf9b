// The questions of the decision trees: to which class does a label belong for a finger? With these
// classes a gesture that was never recorded can descend every tree, finger by finger
// (models/gesture/README.md, "Questions and unseen labels"). Cold.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// The labels of each class, as people write them: [finger][class] names.
using ClassLists = std::array<std::array<std::vector<std::string>, kClasses>, kFingers>;

// Every label of the lists in exactly one class per finger, in order of first mention. Returns an
// error for a label that is in no class or in two classes of a finger, and for a name that is not a
// valid label.
[[nodiscard]] Result<std::vector<Label>> labels_of(const ClassLists& lists);
[[nodiscard]] ClassLists lists_of(const std::vector<Label>& labels);

// The labels of Takamido et al. (models/gesture/README.md, "References"): fist g, scissors c, open
// p, and unseen 1 (index), 3 (index to ring), 4 (all but the thumb). A closed like g, B as in c, C
// open like p.
[[nodiscard]] const std::vector<Label>& built_in_labels();

// A label's pose: the mean angles while the pose is held.
struct LabelPose {
  std::string name;
  HandAngles angles_rad{};
};

// Proposes classes for labels without any: for each finger k-means of the poses' angles with three
// centres, named A to C from the most closed to the most open. Deterministic.
[[nodiscard]] std::vector<Label> propose_labels(const std::vector<LabelPose>& poses);

// Classes of a new label whose pose was shown once: each finger takes the class of the trained
// label whose pose is nearest in that finger. `labels` contains every name of `trained`.
[[nodiscard]] Label label_like(const LabelPose& shown, const std::vector<LabelPose>& trained,
                               const std::vector<Label>& labels);

}  // namespace posed::gesture
