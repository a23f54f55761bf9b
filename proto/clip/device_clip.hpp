// A clip treated as a device: the bytes of each of its frames, and a description from which they
// can be decoded again with no other input. A log holds both, so their form is part of the log
// format:
//
// - BVH, AMC and hand CSV (Format::sends_text): a frame is its piece of the file's text, ended by a
//   line end; the description is the skeleton as JSON, the file's header and its first frame. Logs
//   of posed 0.1 have facts of the whole clip in the place of the skeleton.
// - every other format, and a file of these that was put into other axes or another unit: a frame
//   is its time and its timecode, if the clip has them, and its channel values
//   (FrameParser::numbers); the description is the skeleton as JSON.
//
// Cold.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/clip/frame_parser.hpp"

namespace posed::clip {

// Everything needed to decode the frames of a clip.
struct FrameCoding {
  std::shared_ptr<const Skeleton> skeleton;  // identical, including id, to the one from read_clip()
  double frame_rate_hz = 0.0;
  FrameParser parser;
};

// The whole clip has been read once, so every frame is known to be valid.
struct DeviceClip {
  FrameCoding coding;
  std::string description;          // valid UTF-8 if the file's text is
  std::vector<std::string> frames;  // the bytes of each frame, at least one
  std::vector<double> time_s;       // [frame], as Clip::time_s
  // The first frame is a rest pose that a converter put in front of the motion.
  bool begins_with_added_pose = false;
  std::vector<std::string> warnings;
};

Result<DeviceClip> open_device_clip(const std::filesystem::path& path,
                                    const ReadOptions& options = {});

// `description` is untrusted; `name` is used in error messages.
Result<FrameCoding> parse_description(std::string_view description, const std::string& name);

}  // namespace posed::clip
