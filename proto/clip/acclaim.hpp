// ASF/AMC (Acclaim 1.10): the reader's parts. read_clip() in clip.hpp is the way in for files.
//
// An ASF is a skeleton, an AMC the motion of one. A posed joint is the *start* of an Acclaim bone:
// its offset is its parent bone's direction * length. With C the bone's axis rotation and M the
// turn of its degrees of freedom (listed innermost first), L = C M C^-1 (protocol notes 5f).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"

namespace posed::clip {

// How one bone's values in an AMC become channels.
struct AcclaimBone {
  std::string name;
  std::vector<int> channels;  // of the values in the AMC's order
};

struct Acclaim {
  Skeleton skeleton;  // not finished; metres, radians
  double metres_per_unit = 1.0;
  bool degrees = true;             // values of an AMC that does not say
  std::vector<AcclaimBone> bones;  // [joint]
};

// `name` stands in the errors.
[[nodiscard]] Result<Acclaim> parse_asf(std::string_view text, const std::string& name);

// Whole texts of the two files.
[[nodiscard]] Result<Clip> parse_amc(std::string_view amc, const std::string& amc_name,
                                     std::string_view asf, const std::string& asf_name,
                                     const ReadOptions& options = {});

}  // namespace posed::clip
