// HandClip: the motion of one hand as hand45 angles, from and to the hand CSV, and from any clip
// that has the fifteen finger joints of a hand (a BVH with fingers).
//
// The hand CSV: a header `time_s,thumb1_x_rad,thumb1_y_rad,thumb1_z_rad,thumb2_x_rad, ...,
// little3_z_rad`, then a line a frame. An empty field is a value that is missing. Times may be
// uneven; one that is missing lies half way, one that repeats counts as missing; without any, the
// frames are even at ReadOptions::hand_rate_hz. Times that run back are an error. Cold.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/frame/hand.hpp"

namespace posed::clip {

struct HandClip {
  std::string path;
  Side side = Side::kRight;
  double rate_hz = 30.0;           // 1 / median step, of an even clock 1 / mean step
  std::vector<double> time_s;      // [frame], increasing
  std::vector<HandAngles> angles;  // [frame], rad; NaN where a value is missing
  std::vector<std::string> warnings;
};

// A .csv, or a .bvh or .amc with the finger joints of the hand that `options.hand` names. Errors
// name file and line.
[[nodiscard]] Result<HandClip> read_hand_clip(const std::filesystem::path& path,
                                              const ReadOptions& options = {});

// The same from memory; `name` stands in the errors.
[[nodiscard]] Result<HandClip> parse_hand_csv(std::string_view text, const std::string& name,
                                              const ReadOptions& options = {});

// Takes the hand that a clip has, by its canonical bones.
[[nodiscard]] Result<HandClip> hand_of(const Clip& clip, const ReadOptions& options = {});

// The same motion as a Clip of hand_skeleton(clip.side, the shape called `hand_shape`).
[[nodiscard]] Result<Clip> clip_of_hand(const HandClip& clip, const std::string& hand_shape);

// Fills what is missing: a straight line over a gap, the nearest value at the ends, zero where a
// channel has none at all. Says in `warnings` how much. For formats that cannot leave a gap.
void fill_gaps(HandClip& clip);

// Writes the hand CSV; what is not finite becomes an empty field.
[[nodiscard]] Result<> write_hand_csv(const HandClip& clip, const std::filesystem::path& path);

}  // namespace posed::clip
