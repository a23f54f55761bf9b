// BVH: the reader's parts. read_clip() in clip.hpp is the way in for files; these read from memory
// (tests, fuzzing, a log's device description).
//
// The format (reference: protocol notes 5f): a joint's rotation is the product of its channels in
// listed order, the first outermost; position channels replace OFFSET; degrees; units unknown.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"

namespace posed::clip {

// What stands before the motion lines; offsets still in the file's units.
struct BvhHeader {
  Skeleton skeleton;  // not finished
  double frame_rate_hz = 0.0;
  std::string_view declared_frames;  // what `Frames:` says, which may lie
  std::size_t motion_offset = 0;     // of the first motion line in the text
  int motion_line = 0;               // its line number
};

// `name` stands in the errors. Views in the result point into `text`.
[[nodiscard]] Result<BvhHeader> parse_bvh_header(std::string_view text, const std::string& name);

// A whole BVH text.
[[nodiscard]] Result<Clip> parse_bvh(std::string_view text, const std::string& name,
                                     const ReadOptions& options = {});

}  // namespace posed::clip
