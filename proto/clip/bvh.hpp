// BVH: parts of the clip reader and writer that outputs and tests use on their own. To read or
// write a file, call read_clip() or write_bvh() in clip.hpp.
//
// The format: a joint's rotation is the product of its channels in listed order, the first
// outermost. Position channels replace OFFSET. Angles are in degrees; the unit of length is not
// stated.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "proto/clip/clip.hpp"

namespace posed::clip {

// Everything before the motion lines. Offsets are still in the file's units.
struct BvhHeader {
  Skeleton skeleton;  // Skeleton::finish() has not run yet
  double frame_rate_hz = 0.0;
  std::string_view declared_frames;  // the count after `Frames:`; may be wrong
  std::size_t motion_offset = 0;     // of the first motion line in the text
  int motion_line = 0;               // its line number
  std::string renamed;  // of joints that had the name of an earlier one, a sentence for people
};

// `name` is used in error messages. Views in the result point into `text`.
Result<BvhHeader> parse_bvh_header(std::string_view text, const std::string& name);

// What a BVH cannot say and posed's own say nevertheless, by blanks behind the frame time, which
// every reader skips: unit, upward axis, and whether the zero pose is the T-pose.
struct BvhMark {
  double metres_per_unit = 0.0;
  UpAxis up = UpAxis::kPlusY;
  bool rests_in_t = false;
};
// Empty for a unit that is not usual.
[[nodiscard]] std::string bvh_mark(const BvhMark& mark);
// `header`: everything before the first motion line.
[[nodiscard]] std::optional<BvhMark> find_bvh_mark(std::string_view header);

// The first section of a file, "HIERARCHY" to the last "}", with the skeleton's own channels. Of an
// Acclaim skeleton it would be wrong: convert that first (with_zyx_channels in clip.hpp).
[[nodiscard]] std::string bvh_hierarchy(const Skeleton& skeleton, double metres_per_unit);

}  // namespace posed::clip
