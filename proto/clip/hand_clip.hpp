// HandClip: the motion of one hand as hand45 angles. It is read from and written to the hand CSV,
// or extracted from any clip that has the fifteen finger joints of a hand (a BVH with fingers).
//
// The hand CSV: a header `time_s,thumb1_x_rad,thumb1_y_rad,thumb1_z_rad,thumb2_x_rad, ...,
// little3_z_rad`, then one line per frame. An empty field is a missing value, as are nan, NA, null,
// None and -. Times may be unevenly spaced. A missing time is interpolated; a repeated one counts
// as missing. Without any times the frames are evenly spaced at 30 Hz. Decreasing times are an
// error. Cold.
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
  double rate_hz = 30.0;           // 1 / median step; for an even clock, 1 / mean step
  std::vector<double> time_s;      // [frame], increasing
  std::vector<HandAngles> angles;  // [frame], rad; NaN where a value is missing
  std::vector<std::string> warnings;
};

// Reads a hand's file, or a body's with the finger joints of the hand that `options.hand` names.
// Errors name file and line.
Result<HandClip> read_hand_clip(const std::filesystem::path& path, const ReadOptions& options = {});

// Extracts the hand of a clip, found by its canonical bones. `options.hand` says which; without it
// a clip of two hands is an error.
Result<HandClip> hand_of(const Clip& clip, const ReadOptions& options = {});

// Returns the same motion as a Clip of hand_skeleton(clip.side, the shape named `hand_shape`).
Result<Clip> clip_of_hand(const HandClip& clip, const std::string& hand_shape);

// Fills missing values: linearly over a gap, with the nearest value at the ends, with zero in a
// channel without any value. Reports the number in `warnings`. For formats that cannot hold missing
// values.
void fill_gaps(HandClip& clip);

// Writes the hand CSV; a value that is not finite becomes an empty field.
Result<> write_hand_csv(const HandClip& clip, const std::filesystem::path& path);

}  // namespace posed::clip
