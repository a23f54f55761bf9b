// A labelled hand recording as training sees it: angles at one even rate, segments in frames. Cold.
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

struct Recording {
  std::string file;  // for errors
  double rate_hz = 0.0;
  FeatureMatrix angles_rad;  // [frame][finger][joint][x, y, z]
  std::vector<Segment> segments;
};

// From the first frame to the end of the last [s].
[[nodiscard]] double duration_s(const clip::HandClip& clip);

// At `rate_hz`, by linear interpolation where the clip's own times are not already that. Refuses a
// clip that has fewer frames than a gesture has states, lacks a value (fill gaps with `posed
// smooth`) or has times that do not rise.
[[nodiscard]] Result<Recording> recording_of(const clip::HandClip& clip, double rate_hz);

// Cuts the recording at the labels; `file` is the label file's name for errors. Refuses a segment
// past the end, and one shorter than a gesture has states.
[[nodiscard]] Result<> cut(Recording& recording, const std::vector<clip::LabelSegment>& labels,
                           const std::string& file);

}  // namespace posed::gesture
