// Draft: what each clip reader makes of a file, and the step from there to a Clip, which they
// share.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/clip/frame_parser.hpp"
#include "proto/frame/profile.hpp"
#include "proto/rig/recognise.hpp"

namespace posed::clip {

// The text of one frame in the file.
struct FrameSpan {
  std::string_view text;
  int line = 0;  // line of its first word
};

// How the frames stand in a file whose stream sends its own lines (Format::sends_text).
struct TextFrames {
  FrameParser parser;
  std::string_view header;  // everything before the first frame; points into ClipFile::bytes
  std::vector<FrameSpan> frames;
};

// The result of a format's reader: all frames of a file as numbers. clip_of() adds what only the
// whole clip shows.
struct Draft {
  Skeleton skeleton;                    // metres; unfinished, unless skeleton_is_known
  bool skeleton_is_known = false;       // posed's own: it has bones, root joint and T frames
  std::shared_ptr<const rig::Rig> rig;  // what set bones and T frames; null: not set yet
  std::shared_ptr<const Profile> profile;
  std::vector<std::optional<Bone>> bones{};  // [joint] as the file says; empty: it does not
  std::vector<char> rests_in_t{};  // [joint] that stands in the T-pose in the zero pose; or empty
  // What the user says of the values, which by the format are metres with +Y up. Where the user
  // does not and these may err, a person that stands along another axis is turned, and one that is
  // eight times too large or small scaled, with a warning.
  std::optional<UpAxis> said_up{};
  std::optional<Eigen::Vector3d> said_facing{};
  std::optional<double> said_unit_m{};
  bool up_may_err = false, unit_may_err = false;
  double frame_rate_hz = 0.0;
  double metres_per_unit = 1.0;      // Clip's
  UpAxis up = UpAxis::kPlusY;        // of the file; the skeleton has +Y up
  std::vector<double> values;        // [frame x channel], rad and m
  std::vector<double> time_s{};      // [frame], increasing; empty: evenly spaced, from 0
  std::vector<Timecode> timecode{};  // as Clip::timecode
  std::vector<std::string> warnings;
  std::optional<TextFrames> text{};  // set exactly where the format sends text
};

// Parses the frames of a text into `values`, and into `time_s` the times that they carry, NaN where
// one is missing. Errors name the frame and its line.
Result<> read_frames(const TextFrames& text, const std::string& name, std::vector<double>& values,
                     std::vector<double>& time_s);

// Facts that only all frames show, supplied when only the first frame is available (the description
// in a log of posed 0.1).
struct Hints {
  std::optional<int> root_joint;
  std::vector<std::optional<Eigen::Quaterniond>> T;  // [joint]
};

// Completes the skeleton: bones, root joint, offsets and T frames, as far as the draft does not
// know them. A draft without frames is an error.
Result<Clip> clip_of(Draft draft, const std::string& name, const Hints& hints = {});

}  // namespace posed::clip
