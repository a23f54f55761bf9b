// A labelled recording of a hand or a body for training: angles at one even rate, segments in
// frames. Cold.
#pragma once

#include <string>
#include <vector>

#include "models/gesture/features.hpp"
#include "proto/clip/hand_clip.hpp"
#include "proto/clip/label_file.hpp"
#include "proto/frame/result.hpp"

namespace posed::gesture {

struct Segment {
  int begin = 0, end = 0;  // frames [begin, end)
  std::string label;

  [[nodiscard]] int frames() const { return end - begin; }
};

// The frames of a segment in which its pose is held: the last half without the last tenth.
[[nodiscard]] inline Segment held_part(const Segment& segment) {
  return {segment.begin + segment.frames() / 2, segment.end - segment.frames() / 10, segment.label};
}

struct Recording {
  std::string file;      // for errors
  std::string person{};  // whose hand it is; the same name is one person
  double rate_hz = 0.0;
  FeatureMatrix angles_rad;  // [frame][group][joint][x, y, z]
  std::vector<Segment> segments;
  // True: the recording ends where it began, so its first gesture may follow its last one.
  bool closed = false;
};

// Time from the first frame to the end of the last frame [s].
[[nodiscard]] double duration_s(const clip::HandClip& clip);

// Reads the clip at `rate_hz`, interpolated linearly unless its times already have that rate.
// Errors: fewer frames than a gesture has states, missing values (`posed smooth` fills gaps), times
// that do not increase.
Result<Recording> recording_of(const clip::HandClip& clip, double rate_hz);

// Cuts the recording at the labels; `file` is the label file's name for errors. Returns an error
// for a segment past the end of the recording and for one with fewer frames than a gesture has
// states.
Result<> cut(Recording& recording, const std::vector<clip::LabelSegment>& labels,
             const std::string& file);

}  // namespace posed::gesture
