// A clip seen as a device: its frames as pieces of text exactly as they stand in the file, and a
// description from which they can be decoded again, one by one, with nothing else at hand.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "proto/clip/clip.hpp"
#include "proto/clip/frame_text.hpp"

namespace posed::clip {

// What it takes to decode the frames of a clip.
struct ClipFormat {
  std::shared_ptr<const Skeleton> skeleton;  // the same, id included, as read_clip() gives
  double frame_rate_hz = 0.0;
  FrameParser parser;
};

// The whole clip has been read once, so every frame is known to be good.
struct TextClip {
  ClipFormat format;
  std::string description;  // for parse_description(): the clip's header and its first frame
  std::vector<std::string_view> frames;  // into `text`
  std::vector<double> time_s;            // [frame], as Clip::time_s
  std::vector<std::string> warnings;
  std::string text;  // the file
};

[[nodiscard]] Result<std::unique_ptr<const TextClip>> open_text_clip(
    const std::filesystem::path& path, const ReadOptions& options = {});

// `name` stands in the errors.
[[nodiscard]] Result<ClipFormat> parse_description(std::string_view description,
                                                   const std::string& name);

}  // namespace posed::clip
