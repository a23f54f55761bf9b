// A clip treated as a device: its frames as pieces of text exactly as in the file, and a
// description from which each frame can be decoded again with no other input.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/clip/frame_text.hpp"

namespace posed::clip {

// Everything needed to decode the frames of a clip.
struct ClipFormat {
  std::shared_ptr<const Skeleton> skeleton;  // identical, including id, to the one from read_clip()
  double frame_rate_hz = 0.0;
  FrameParser parser;
};

// The whole clip has been read once, so every frame is known to be valid.
struct TextClip {
  ClipFormat format;
  std::string description;               // views into `text`
  std::vector<std::string_view> frames;  // into `text`
  std::vector<double> time_s;            // [frame], as Clip::time_s
  std::vector<std::string> warnings;
  std::string text;  // content of the file
};

[[nodiscard]] Result<std::unique_ptr<const TextClip>> open_text_clip(
    const std::filesystem::path& path, const ReadOptions& options = {});

// `name` is used in error messages.
[[nodiscard]] Result<ClipFormat> parse_description(std::string_view description,
                                                   const std::string& name);

}  // namespace posed::clip
