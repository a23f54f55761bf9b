// The questions of the decision trees: to which class does a label belong for a finger, or for a
// group of a body's joints? With these classes a gesture that was never recorded can descend every
// tree, group by group
// (models/gesture/README.md, "Questions and unseen labels"). Cold.
#pragma once

#include <string>
#include <vector>

#include "models/gesture/vocabulary.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

// The labels of each class, as people write them: [group][class] names.
using ClassLists = std::vector<std::vector<std::vector<std::string>>>;

// Every label of the lists in exactly one class per group, in order of first mention. Returns an
// error for a label that is in no class or in two classes of a group, and for a name that is not a
// valid label.
Result<std::vector<Label>> labels_of(const ClassLists& lists,
                                     const std::vector<ChannelGroup>& groups = finger_groups());
[[nodiscard]] ClassLists lists_of(const std::vector<Label>& labels,
                                  const std::vector<ChannelGroup>& groups = finger_groups());

// The labels of Takamido et al. (models/gesture/README.md, "References"): fist g, scissors c, open
// p, and unseen 1 (index), 3 (index to ring), 4 (all but the thumb). A closed like g, B as in c, C
// open like p.
[[nodiscard]] const std::vector<Label>& built_in_labels();
[[nodiscard]] Vocabulary built_in_vocabulary();

// A label's pose: the mean of each channel while the pose is held [rad].
struct LabelPose {
  std::string name;
  std::vector<double> angles_rad{};
};

// Proposes classes for a hand's labels without any: for each finger k-means of the poses' angles
// with three centres, named A to C from the most closed to the most open. Deterministic.
[[nodiscard]] std::vector<Label> propose_labels(const std::vector<LabelPose>& poses);

// Proposes classes for a body's labels, in the groups of `vocabulary`: poses of one class are
// alike, within 15 degrees rms over the group's joints; A is the class of the pose that is nearest
// to all others. Sets the groups' numbers of classes, too.
void propose_body_labels(const std::vector<LabelPose>& poses, Vocabulary& vocabulary);

// Classes of a new label whose pose was shown once: each group takes the class of the trained label
// whose pose is nearest in that group. `labels` contains every name of `trained`.
[[nodiscard]] Label label_like(const LabelPose& shown, const std::vector<LabelPose>& trained,
                               const std::vector<Label>& labels,
                               const std::vector<ChannelGroup>& groups = finger_groups());

// How far the shown pose lies from the one that its classes compose: rms over all channels [rad],
// each group beside the nearest of the trained poses. Infinite without any.
[[nodiscard]] double composed_off_rad(const LabelPose& shown, const std::vector<LabelPose>& trained,
                                      const std::vector<ChannelGroup>& groups = finger_groups());

}  // namespace posed::gesture
