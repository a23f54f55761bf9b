// ASF/AMC (Acclaim 1.10): parts of the clip reader. To read a file, call read_clip() in clip.hpp.
//
// An ASF file holds a skeleton, an AMC file a motion of it. A posed joint sits at the *start* of an
// Acclaim bone: its offset is its parent bone's direction * length. With C the bone's axis rotation
// and M the rotation by its degrees of freedom (listed innermost first), the joint's local rotation
// is L = C M C^-1.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"

namespace posed::clip {

// Maps the values of one bone in an AMC to channels.
struct AcclaimBone {
  std::string name;
  std::vector<int> channels;  // [value, in the AMC's order] index of the channel
};

struct Acclaim {
  Skeleton skeleton;  // metres, radians; Skeleton::finish() has not run yet
  double metres_per_unit = 1.0;
  bool degrees = true;             // unit of angles in an AMC that does not state one
  std::vector<AcclaimBone> bones;  // [joint]
};

// `name` is used in error messages.
Result<Acclaim> parse_asf(std::string_view text, const std::string& name);

}  // namespace posed::clip
