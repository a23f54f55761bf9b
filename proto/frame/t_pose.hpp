// T: the global rotation of each joint when the figure stands in the canonical T-pose (Y up, facing
// +Z, left hand to +X, every limb along an axis). It turns a source's local rotation L into the
// canonical one, Lc = T_parent L T_joint^-1, which is identity in T-pose (models/motion/README.md,
// "Canonical humanoid").
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/frame/skeleton.hpp"

namespace posed {

// Known T frames; empty entries are found by the rule below.
using KnownT = std::vector<std::optional<Eigen::Quaterniond>>;  // [joint]

// The rule for a zero pose near the T-pose: a limb's T is its parent's, rotated by the smallest
// angle that aligns the bone with its canonical axis. The trunk, the thumbs and joints that are not
// bones keep their parent's T, because the curve of a back belongs to the person, not to the pose.
// Cold.
void set_t_frames(Skeleton& skeleton, const KnownT& known = {});

// True when every limb of the zero pose lies within 45 degrees of its canonical axis (feet: 80).
[[nodiscard]] bool zero_pose_is_t(const Skeleton& skeleton);

// The rule for any other zero pose. `standing` holds the joints' mean global rotations while the
// figure stands or walks, with the heading removed [joint]. Each bone's rotation is turned by the
// smallest angle onto its axis and then snapped to the nearest of the 24 rotations that map axes to
// axes. Forearms, hands and fingers that already fit with their parent's T take that one.
[[nodiscard]] KnownT t_frames_from_mean_pose(const Skeleton& skeleton,
                                             std::span<const Eigen::Quaterniond> standing);

// The text form of a rotation that maps axes to axes: where x, y and z go, "+y-x+z". Parsing
// rejects text that is not such a rotation.
[[nodiscard]] std::string axes_text(const Eigen::Quaterniond& T);
[[nodiscard]] std::optional<Eigen::Quaterniond> axes_from_text(std::string_view text);

}  // namespace posed
