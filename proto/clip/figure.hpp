// A clip's figure: its axes and offsets as the file has them, and what the recogniser (proto/rig)
// says of it. Cold.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/frame/profile.hpp"
#include "proto/rig/recognise.hpp"

namespace posed::clip {

// Position channels of a joint below the root replace its OFFSET; but some exporters (Blender, of
// MakeHuman figures) write there what is to be added to it, which is nearly nothing. `first` is the
// clip's first frame, in the unit of the offsets. Returns what the joint's offset is.
[[nodiscard]] Eigen::Vector3d settled_offset(const Skeleton& skeleton, int joint,
                                             std::span<const double> first);

// The frames of a clip that the recogniser looks at: evenly chosen, the first among them.
[[nodiscard]] std::vector<int> sample_frames(int frames, int joints);

// Asks the recogniser. `sample` holds such frames, in rad and the unit of the skeleton's offsets;
// of `known`, bones, T, up and unit are given by the caller.
[[nodiscard]] rig::Rig recognise(const Skeleton& skeleton, const ChannelMatrix& sample,
                                 rig::RigInput known);

// Sets bones and T as found.
void apply(const rig::Rig& rig, Skeleton& skeleton);

// What a profile says of the skeleton, for recognise(). An error names the joints that are missing.
Result<> add_profile(const Profile& profile, const Skeleton& skeleton, rig::RigInput& known);

// Leaves out joints of a figure that has more than posed carries: those that are no bones and have
// none below them, the last first, from the skeleton and from what is known of its joints. Returns
// which channels stay [channel]; empty when all do, or
// when the bones alone are too many.
std::vector<char> leave_out_joints(Skeleton& skeleton, rig::Rig& rig);

// The sentence about it, for a figure that had so many joints and has fewer now.
[[nodiscard]] std::string left_out(std::size_t before, std::size_t now);

// Expresses the figure in axes turned by `turn`, which maps axes to axes. Returns the factor, 1 or
// -1, by which the values of each channel change; channels keep their order.
std::vector<double> turn_axes(const Eigen::Matrix3d& turn, Skeleton& skeleton);

// Metres in the unit of this name (m, dm, cm, mm, inch, foot), or the number of metres that the
// text is; empty for anything else.
[[nodiscard]] std::optional<double> metres_of_unit(std::string_view text);

}  // namespace posed::clip
