// Writes pictures and videos. posed draws SVG itself; rsvg-convert (librsvg) makes a PNG of it and
// ffmpeg a video. None of them needs a display. Cold.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "proto/frame/result.hpp"

namespace posed::picture {

// `path` ends in .svg or .png.
[[nodiscard]] Result<> write_picture(const std::string& svg, const std::filesystem::path& path);

struct Video {
  int frames = 0;
  double rate_hz = 30.0;
  std::function<std::string(int frame)> draw;  // SVG files of one size
  std::function<bool(int done)> progress;      // called before each frame; false interrupts
};
// `path` ends in .mp4.
[[nodiscard]] Result<> write_video(const Video& video, const std::filesystem::path& path);

}  // namespace posed::picture
