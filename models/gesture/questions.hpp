// What the trees ask: which class a finger of a gesture is of. The classes let a gesture that was
// never recorded find its way down every tree, a finger at a time (models/gesture/README.md,
// "Questions and unseen labels"). Cold.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "models/gesture/gesture_model.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// Who is in which class, as people write it: [finger][class] names.
using ClassLists = std::array<std::array<std::vector<std::string>, kClasses>, kFingers>;

// Every label of the lists in exactly one class per finger, in order of first mention. Refuses a
// label that a finger has in no class or in two, and a name that is no label.
[[nodiscard]] Result<std::vector<Label>> labels_of(const ClassLists& lists);
[[nodiscard]] ClassLists lists_of(const std::vector<Label>& labels);

// The hands of Takamido et al. (models/gesture/README.md, "References"): fist g, scissors c, open
// p, and unseen 1 (index), 3 (index to ring), 4 (all but the thumb). A closed like g, B as in c, C
// open like p.
[[nodiscard]] const std::vector<Label>& built_in_labels();

// A label's pose: the mean angles while it is held.
struct LabelPose {
  std::string name;
  HandAngles angles_rad{};
};

// Classes for labels that nobody sorted: for each finger k-means of the poses' angles with three
// centres, named A to C from the most closed to the most open. Deterministic.
[[nodiscard]] std::vector<Label> propose_labels(const std::vector<LabelPose>& poses);

// "Show the new pose once": each finger takes the class of the trained label whose pose is nearest
// in that finger. `labels` has every name of `trained`.
[[nodiscard]] Label label_like(const LabelPose& shown, const std::vector<LabelPose>& trained,
                               const std::vector<Label>& labels);

}  // namespace posed::gesture
