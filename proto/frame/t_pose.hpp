// T: the global rotation of each joint when the figure stands in the canonical T-pose (Y up, facing
// +Z, left hand to +X, every limb along an axis). With it a source's local rotation L becomes the
// canonical one, Lc = T_parent L T_joint^-1, identity in T-pose (models/motion/README.md,
// "Canonical humanoid").
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/skeleton.hpp"

namespace posed {

// T frames that are known; nothing where the rule shall find them.
using KnownT = std::vector<std::optional<Eigen::Quaterniond>>;  // [joint]

// The rule for a zero pose near T: a limb's T is its parent's, turned the smallest way that lays
// the bone along its canonical axis. The trunk, the thumbs and joints that are no bone keep their
// parent's T: the curve of a back is the person's, no pose. Cold.
void set_t_frames(Skeleton& skeleton, const KnownT& known = {});

// Every limb of the zero pose lies within 45 degrees of its canonical axis (feet: 80).
[[nodiscard]] bool zero_pose_is_t(const Skeleton& skeleton);

// The rule where the zero pose says nothing: `standing` are the joints' mean global rotations while
// the figure stands or walks, heading removed [joint]. Each bone's is turned the smallest way onto
// its axis and then snapped to the nearest of the 24 rotations that map axes to axes; forearms,
// hands and fingers that lie right in their parent's T take that.
[[nodiscard]] KnownT t_frames_from_standing(const Skeleton& skeleton,
                                            std::span<const Eigen::Quaterniond> standing);

// A rotation that maps axes to axes, written as where x, y and z go: "+y-x+z". Parsing refuses what
// is no rotation.
[[nodiscard]] std::string axes_text(const Eigen::Quaterniond& T);
[[nodiscard]] std::optional<Eigen::Quaterniond> axes_from_text(std::string_view text);

}  // namespace posed
