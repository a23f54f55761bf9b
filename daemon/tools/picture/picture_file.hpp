// Writes pictures and videos. posed draws SVG itself; rsvg-convert (librsvg) makes a PNG of it and
// ffmpeg a video. None of them needs a display. Cold.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "proto/frame/result.hpp"

namespace posed::picture {

// Runs `arguments`, of which the first is the program's name, found in PATH. Its input is empty and
// its output is discarded. `package`: of Debian, for the sentence that is returned if the program
// is not installed. Ctrl-C reaches the program too; then the error says that it was interrupted.
Result<> run_program(const std::vector<std::string>& arguments, const std::string& package);

// `path` ends in .svg or .png.
Result<> write_picture(const std::string& svg, const std::filesystem::path& path);

struct Video {
  int frames = 0;
  double rate_hz = 30.0;
  std::function<std::string(int frame)> draw;  // SVG files of one size
  std::function<bool(int done)> progress;      // called before each frame; false interrupts
};
// `path` ends in .mp4 or in .webp, which repeats for ever.
Result<> write_video(const Video& video, const std::filesystem::path& path);

}  // namespace posed::picture
